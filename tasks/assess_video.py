"""Everything that is measured on a candidate, in a process of its own."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from robojackson.cli.lifetime.video_process import in_video_process, probed
from robojackson.clips.pose_detector import model_path
from robojackson.clips.quality.assessment import Assessment, AssessmentConfig
from robojackson.clips.quality.assessment import assess_video as measure
from robojackson.files.local_folder import sha256_of_file
from storage import artifact_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.stage import stage


def _models(parameters: Mapping[str, Any]) -> list[str]:
    return [sha256_of_file(model_path(parameters["config"].detector))]


@stage(models=_models)
def assess_video(video: Artifact, config: AssessmentConfig) -> dict[str, Artifact]:
    """Return `landmarks` (LandmarkTrack), `stability` (StabilityScore), `quality` and `info`
    (JSON)."""
    store = Store.from_environment()
    with store.local(video) as path:
        frames = probed(path, config.video).frames
        found: Assessment = in_video_process(measure, path, config, frames=frames)
    info = {key: value for key, value in asdict(found.info).items() if key != "path"}
    return {
        "landmarks": artifact_tables.save(store, "landmarks", "landmarks.parquet", found.track),
        "stability": artifact_tables.save(store, "stability", "stability.parquet", found.stability),
        "quality": store.save(
            "quality", "quality.json", json.dumps(asdict(found.quality)).encode()
        ),
        "info": store.save("video", "info.json", json.dumps(info).encode()),
    }
