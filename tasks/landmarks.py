"""Landmarks of a video, by the pose model of a given size."""

import threading
from collections.abc import Mapping
from typing import Any

from robojackson.clips.landmarks import detect, model_path
from storage import tables
from storage.artifact import Artifact, sha256_of_file
from storage.store import Store
from tasks.caching import stage
from tasks.probe import info_of

ONE_AT_A_TIME = threading.Lock()
"""The detector uses all cores by itself, and redirects the process's stderr while it starts."""


def _models(parameters: Mapping[str, Any]) -> list[str]:
    return [sha256_of_file(model_path(parameters["size"]))]


@stage(models=_models)
def landmarks(video: Artifact, info: Artifact, size: str) -> Artifact:
    """LandmarkTrack."""
    store = Store.from_environment()
    with store.local(video) as path, ONE_AT_A_TIME:
        track = detect(path, info_of(store, info, path), size)
    return tables.keep(store, "landmarks", "landmarks.parquet", track)
