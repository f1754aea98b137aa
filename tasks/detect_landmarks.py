"""Landmarks of a video, by the pose model of a given size."""

import threading
from collections.abc import Mapping
from typing import Any

from robojackson.cli.lifetime.video_process import in_video_process
from robojackson.clips.people.dancer import DancerConfig
from robojackson.clips.people.tracked_people import SCOUT
from robojackson.clips.pose_detector import detect, model_path
from robojackson.files.local_folder import sha256_of_file
from robojackson.mocap.landmarks import landmark_pipeline
from storage import artifact_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.probe_video import info_of
from tasks.runtime.stage import stage

ONE_AT_A_TIME = threading.Lock()
"""The detector uses all cores by itself."""


def one_at_a_time() -> threading.Lock:
    """Return the lock, by a name that can be sent to another process, where it is another lock."""
    return ONE_AT_A_TIME


def _models(parameters: Mapping[str, Any]) -> list[str]:
    sizes = [
        *landmark_pipeline.models_of(parameters["size"]),
        *([SCOUT] if parameters.get("dancer") else []),
    ]
    return [sha256_of_file(model_path(size)) for size in sizes]


@stage(models=_models)
def detect_landmarks(
    video: Artifact, info: Artifact, size: str, dancer: DancerConfig | None = None
) -> Artifact:
    """Return the LandmarkTrack of one person, or (Algorithm 1) of the one that the detector
    prefers."""
    store = Store.from_environment()
    with store.local(video) as path, one_at_a_time():
        known = info_of(store, info, path)
        frames = known.frames
        if dancer:
            work = landmark_pipeline.detect_landmarks
            track = in_video_process(work, path, known, size, dancer, frames=frames)
        else:
            track = in_video_process(detect, path, known, size, frames=frames)
    return artifact_tables.save(store, "landmarks", "landmarks.parquet", track)
