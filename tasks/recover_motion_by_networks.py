"""Recover the motion of the person by published networks with weights of the user."""

import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from robojackson.clips.video import read_frames
from robojackson.mocap.networks.inference import load_networks
from robojackson.mocap.networks.network_config import NetworkConfig
from robojackson.mocap.networks.network_motion import network_motion
from robojackson.mocap.networks.weight_files import sha256_of
from robojackson.mocap.recover import MocapConfig
from robojackson.motion.landmark_track import LandmarkTrack
from storage import artifact_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.stage import stage

REPORTS = 10
"""Lines of progress in a clip."""
log = logging.getLogger(__name__)


def _models(parameters: Mapping[str, Any]) -> list[str]:
    return [sha256_of(Path(file)) for file in parameters["network"].files]


@stage(models=_models)
def recover_motion_by_networks(
    video: Artifact, landmarks: Artifact, network: NetworkConfig, config: MocapConfig
) -> Artifact:
    """Return the SmplSequence of the dancer, by HybrIK's and NIKI's networks."""
    store = Store.from_environment()
    track = artifact_tables.read(LandmarkTrack, store, landmarks)
    networks = load_networks(network)
    with store.local(video) as path:
        images = read_frames(path)
        sequence = network_motion(track, images, networks, config, network, _teller())
    return artifact_tables.save(store, "mocap", "smpl.parquet", sequence)


def _teller() -> Callable[[int, int], None]:
    reported = 0

    def report(done: int, total: int) -> None:
        nonlocal reported
        if done * REPORTS // total > reported:
            reported = done * REPORTS // total
            log.info("networks: %d of %d frames", done, total)

    return report
