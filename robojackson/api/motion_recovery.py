"""The motion of a tracked person: by the networks whose weights a user brought, or by our own."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

from robojackson.clips.video import read_frames
from robojackson.mocap.recover import recover_motion
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.pipeline_config import PipelineConfig

Progress = Callable[[int, int], None]


def motion_recoverer(
    video: Path,
    settings: PipelineConfig,
    progress_bar: Callable[[str], AbstractContextManager[Progress]],
) -> Callable[[LandmarkTrack], SmplSequence]:
    """What `settings.network` chooses, its weights loaded before the work begins.

    Args:
        video: The file that the networks look at.
        settings: Of the whole pass.
        progress_bar: Shows the progress of a named part.

    Raises:
        BadWeights: a file of weights cannot be used.
    """
    if not settings.network.hybrik:
        return lambda track: recover_motion(track, settings.mocap)
    from robojackson.mocap.networks.inference import load_networks
    from robojackson.mocap.networks.network_motion import network_motion

    networks = load_networks(settings.network)

    def move(track: LandmarkTrack) -> SmplSequence:
        images = read_frames(video)
        with progress_bar(f"networks on {video.name}") as progress:
            chosen = (settings.mocap, settings.network)
            return network_motion(track, images, networks, *chosen, progress)

    return move
