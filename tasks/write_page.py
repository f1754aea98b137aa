"""The folder of a run that a person opens: the page, the video and every table, side by side."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robojackson.clips.quality.advice import advise
from robojackson.clips.quality.stability import Stability
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.rollout import Rollout
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.table_schemas import EPISODE_RECORD, EVALUATION_RECORD
from storage import artifact_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.probe_video import info_of
from tasks.runtime.code_digest import template_digests
from tasks.runtime.stage import stage

if TYPE_CHECKING:
    from robojackson.report.pages.page_content import Results

PAGE = "index.html"
TEMPLATES = ("page.html", "page.css")
LEFT_OUT = ("video", "info")
"""Artifacts that stay where they are: the user has the video already."""


@stage(models=lambda parameters: template_digests(__name__, TEMPLATES))
def write_page(
    made: dict[str, Artifact], move: str, file: str, folder: str = ""
) -> dict[str, Artifact]:
    """Write everything under `dances/<move>-<digest>/`; return its artifacts and `page`.

    Args:
        made: What the other stages made, by name.
        move: Name of the dance, for the folder.
        file: Name of the file that is danced; the same video may be stored under another.
        folder: Where to, instead of there.
    """
    if not folder:
        digest = hashlib.sha256("".join(a.sha256 for a in made.values()).encode()).hexdigest()
        folder = f"dances/{move}-{digest[:8]}"
    return _written(made, file, folder)


def write_first_page(made: dict[str, Artifact], move: str, file: str, folder: str) -> str | None:
    """Write the page that a later `write_page` into the same folder replaces; not a stage.

    Returns:
        Its address; None where there is a page already, which is not replaced by less.
    """
    store = Store.from_environment()
    if store.exists(f"{folder}/{PAGE}"):
        return None
    return store.address(_written(made, file, folder)["page"].key)


def _written(made: dict[str, Artifact], file: str, folder: str) -> dict[str, Artifact]:
    """Return the page and all files that belong to it, in a folder."""
    from robojackson.report.pages.page_content import page_content
    from robojackson.report.pages.run_page import render  # matplotlib

    store = Store.from_environment()
    text = render(page_content(_results(store, made, Path(file)), made["dance"].name))
    kept = {
        name: store.put(f"{folder}/{artifact.name}", store.read(artifact.key))
        for name, artifact in made.items()
        if name not in LEFT_OUT
    }
    return {**kept, "page": store.put(f"{folder}/{PAGE}", text.encode())}


def _results(store: Store, made: Mapping[str, Artifact], file: Path) -> "Results":
    from robojackson.report.pages.page_content import Results

    return Results(
        title=file.stem.replace("_", " "),
        info=info_of(store, made["info"], file),
        stability=artifact_tables.read(Stability, store, made["stability"]),
        sequence=artifact_tables.read(SmplSequence, store, made["smpl"]),
        reference=artifact_tables.read(ReferenceMotion, store, made["reference"]),
        training=_json(store, made["training"]) if "training" in made else {},
        episodes=_episodes(store, made),
        evaluation=joined_evaluation(store, made),
        evaluations=artifact_tables.read_rows(EVALUATION_RECORD, store, made["evaluations"]),
        rollout_qpos=artifact_tables.read(Rollout, store, made["rollout"]).qpos,
        advice=advise(artifact_tables.read(LandmarkTrack, store, made["landmarks"])),
        tracker_video=made["tracker_dance"].name if "tracker_dance" in made else None,
    )


def joined_evaluation(store: Store, made: Mapping[str, Artifact]) -> dict[str, Any]:
    """Return the summary of an evaluation, with that of a tracker under `trackers` where both
    danced."""
    summary = _json(store, made["evaluation"])
    if "tracker_evaluation" in made:
        other = _json(store, made["tracker_evaluation"])
        summary["trackers"] = {other["tracker"]: other}
    return summary


def _episodes(store: Store, made: Mapping[str, Artifact]) -> list[dict[str, Any]]:
    if "episodes" not in made:
        return []
    return artifact_tables.read_rows(EPISODE_RECORD, store, made["episodes"])


def _json(store: Store, artifact: Artifact) -> dict[str, Any]:
    return dict(json.loads(store.read(artifact.key)))
