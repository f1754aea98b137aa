"""Other motions that a video allows: what hidden limbs may have done."""

from collections.abc import Iterator
from dataclasses import replace

from robojackson.errors import BadConfiguration
from robojackson.mocap.recover import recover_motion
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.pipeline_config import PipelineConfig


def hypothesis_files(settings: PipelineConfig, count: int) -> list[str]:
    """Return `smpl_1.parquet` and so on.

    Raises:
        BadConfiguration: there is no temporal network in this run to sample from.
    """
    if count and (settings.network.hybrik or not settings.mocap.temporal.enabled):
        raise BadConfiguration(
            "--hypotheses samples the embedded temporal network: omit --hybrik and set "
            "mocap.temporal.enabled=true"
        )
    return [f"smpl_{number}.parquet" for number in range(1, count + 1)]


def sample_hypotheses(
    track: LandmarkTrack, settings: PipelineConfig, count: int
) -> Iterator[tuple[str, SmplSequence]]:
    """Yield the samples of the temporal network, seeded, each with the name of its file."""
    for number, name in enumerate(hypothesis_files(settings, count), 1):
        temporal = replace(settings.mocap.temporal, hypothesis=number)
        yield name, recover_motion(track, replace(settings.mocap, temporal=temporal))
