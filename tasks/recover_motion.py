"""Recover the motion of the person from landmarks."""

from collections.abc import Mapping
from typing import Any

from robojackson.files.local_folder import sha256_of_file
from robojackson.mocap import recover
from robojackson.mocap.recover import MocapConfig
from robojackson.motion.landmark_track import LandmarkTrack
from storage import artifact_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.stage import stage


def _models(parameters: Mapping[str, Any]) -> list[str]:
    """Return the digest of the temporal network's weights, if it is used; the stage misses a
    missing file."""
    config = parameters["config"].temporal
    return [sha256_of_file(config.file)] if config.enabled and config.file.is_file() else []


@stage(models=_models)
def recover_motion(landmarks: Artifact, config: MocapConfig) -> Artifact:
    """Return the SmplSequence of the dancer."""
    store = Store.from_environment()
    track = artifact_tables.read(LandmarkTrack, store, landmarks)
    return artifact_tables.save(
        store, "mocap", "smpl.parquet", recover.recover_motion(track, config)
    )
