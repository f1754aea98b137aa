"""The folder of a run that a person opens: the page, the video and every table, side by side."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robojackson.clips.quality.advice import advise
from robojackson.clips.quality.stability import Stability
from robojackson.files.json_types import to_json
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.rollout import Rollout
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.table_schemas import EPISODE_RECORD, EVALUATION_RECORD
from robojackson.pipeline.tracker_descriptions import describe_tracker
from robojackson.report.pages.evaluation_text import beat_rows
from robojackson.report.pages.live_page import live_page
from robojackson.report.pages.run_page import PageCandidate
from robojackson.report.video.film import VideoConfig
from robojackson.report.web.live_data import why_not_live
from robojackson.report.web.shown_run import RecordedRun, ShownRun, shown_run, thumbnail
from robojackson.rl.evaluation.controllers import Evaluated
from robojackson.rl.policy import load_policy
from robojackson.rl.trackers.tracker_file import open_tracker
from robojackson.robot.model import Robot, RobotDescription, load_robot
from storage import artifact_tables
from storage.artifact import Artifact
from storage.store import Store
from storage.study_tables import Place
from tasks.probe_video import info_of
from tasks.publish_tables import content_at
from tasks.render_video import music_digest
from tasks.runtime.code_digest import template_digests
from tasks.runtime.run_logger import run_logger
from tasks.runtime.stage import stage

if TYPE_CHECKING:
    from robojackson.report.pages.page_content import Results

PAGE, LIVE, BEATS = "index.html", "live.html", "beats.json"
TEMPLATES = (
    "page.html", "page.css", "figures.html", "scene.js", "page.js", "live.html", "live.js",
    "dance.js",
)  # fmt: skip
IN_BROWSERS = ("regulator", "policy")
"""Kinds of trackers that a live page can run."""
LEFT_OUT = ("video", "info")
"""Artifacts that stay where they are: the user has the video already."""


@dataclass(frozen=True)
class ScoredClip:
    """A candidate.

    Attributes:
        name: Name of the file.
        video: The clip.
        reason: Why it is danced, or not.
        chosen: Whether it is danced.
    """

    name: str
    video: Artifact
    reason: str
    chosen: bool


@dataclass(frozen=True)
class PageSettings:
    """What a page needs besides what the stages made.

    Attributes:
        robot: The robot that dances.
        render: How the video looks; the page shows the same moments.
        configuration: Configuration of the pass, as YAML.
        candidates: Clips that were scored, the one that is danced among them.
        longer: Options of `dance` for a longer training.
        begin_s: Where the clip begins in its video, seconds: advice is about the video.
    """

    robot: RobotDescription
    render: VideoConfig
    configuration: str = ""
    candidates: tuple[ScoredClip, ...] = ()
    longer: str = ""
    begin_s: float = 0.0


def _models(parameters: Mapping[str, Any]) -> list[str]:
    music = music_digest(parameters["settings"].render)
    return [*template_digests(__name__, TEMPLATES), *music]


@stage(models=_models)
def write_page(
    made: dict[str, Artifact], place: Place, file: str, settings: PageSettings, folder: str = ""
) -> dict[str, Artifact]:
    """Write everything under `dances/<move>-<digest>/`; return it, `page`, `beats` and `live`.

    Args:
        made: What the other stages made, by name.
        place: Names of the run in its tables; its `move` names the folder, too.
        file: Name of the file that is danced; the same video may be stored under another.
        settings: Further inputs of the page.
        folder: Where to, instead of there.
    """
    if not folder:
        digest = hashlib.sha256("".join(a.sha256 for a in made.values()).encode()).hexdigest()
        folder = f"dances/{place.move}-{digest[:8]}"
    return _written(made, place, file, settings, folder)


def write_early_page(
    made: dict[str, Artifact],
    place: Place,
    file: str,
    settings: PageSettings,
    folder: str,
    again: bool = False,
) -> str | None:
    """Write a page that a later `write_page` into the same folder replaces; not a stage.

    Args:
        made, place, file, settings, folder: See `write_page`; the video, `dance`, may be to come.
        again: Whether a page that exists is written again.
    Returns:
        Address of the page; None where one exists that stays.
    """
    store = Store.from_environment()
    if store.exists(f"{folder}/{PAGE}") and not again:
        return None
    return store.address(_written(made, place, file, settings, folder)["page"].key)


def _written(
    made: dict[str, Artifact], place: Place, file: str, settings: PageSettings, folder: str
) -> dict[str, Artifact]:
    """Return the page and all files that belong to it, in a folder."""
    from robojackson.report.pages.page_content import page_content
    from robojackson.report.pages.run_page import render  # matplotlib

    store = Store.from_environment()
    run = recorded_run(store, made, load_robot(settings.robot))
    with store.local(made["video"]) as clip:
        shown = shown_run(run, clip, settings.render)
    results, files = _results(store, made, Path(file), run, shown, settings), {}
    live = live_page(run, results.title)
    if live is not None:
        files["live"] = store.put(f"{folder}/{LIVE}", live.encode())
        results = replace(results, live=LIVE)
    elif "dance" in made:
        run_logger().info("no live page: %s", why_not_live(run.policy, run.robot))
    text = render(page_content(results, made["dance"].name if "dance" in made else None))
    kept = {
        name: store.put(f"{folder}/{artifact.name}", content_at(place, store, name, artifact))
        for name, artifact in made.items()
        if name not in LEFT_OUT
    }
    if shown.beats is not None:
        files["beats"] = store.put(f"{folder}/{BEATS}", json.dumps(shown.beats).encode())
        card = _json(store, made["scorecard"]) | {"beats": shown.beats["figures"]}
        key = f"{folder}/{made['scorecard'].name}"
        files["scorecard"] = store.put(key, to_json(card))
    return {**kept, **files, "page": store.put(f"{folder}/{PAGE}", text.encode())}


def recorded_run(store: Store, made: Mapping[str, Artifact], robot: Robot) -> RecordedRun:
    """Read what a pass has left."""
    return RecordedRun(
        robot=robot,
        track=artifact_tables.read(LandmarkTrack, store, made["landmarks"]),
        sequence=artifact_tables.read(SmplSequence, store, made["smpl"]),
        reference=artifact_tables.read(ReferenceMotion, store, made["reference"]),
        rollout_qpos=artifact_tables.read(Rollout, store, made["rollout"]).qpos,
        policy=_dancer(store, made),
    )


def _dancer(store: Store, made: Mapping[str, Artifact]) -> Evaluated | None:
    """Return the policy, or the tracker where it needs no network of another project."""
    if "policy" in made:
        with store.local(made["policy"]) as path:
            return load_policy(path)
    name = _json(store, made["evaluation"]).get("tracker")
    found = None if name is None else describe_tracker(name)
    return open_tracker(found) if found and found.network in IN_BROWSERS else None


def _results(
    store: Store,
    made: Mapping[str, Artifact],
    file: Path,
    run: RecordedRun,
    shown: ShownRun,
    settings: PageSettings,
) -> "Results":
    from robojackson.report.pages.page_content import Results

    return Results(
        title=file.stem.replace("_", " "),
        info=info_of(store, made["info"], file),
        stability=artifact_tables.read(Stability, store, made["stability"]),
        sequence=run.sequence,
        reference=run.reference,
        training=_json(store, made["training"]) if "training" in made else {},
        episodes=_episodes(store, made),
        evaluation=joined_evaluation(store, made),
        evaluations=artifact_tables.read_rows(EVALUATION_RECORD, store, made["evaluations"]),
        advice=advise(run.track, settings.begin_s),
        tracker_video=made["tracker_dance"].name if "tracker_dance" in made else None,
        player=shown.player,
        film=shown.film,
        has_sound=shown.has_sound,
        beats=beat_rows(shown.beats) if shown.beats else (),
        candidates=[
            PageCandidate(each.name, each.reason, each.chosen, _thumbnail(store, each.video))
            for each in settings.candidates
        ],
        provenance={name: artifact.sha256[:16] for name, artifact in sorted(made.items())},
        settings=settings.configuration,
        longer=settings.longer,
    )


def _thumbnail(store: Store, video: Artifact) -> str:
    with store.local(video) as path:
        return thumbnail(path)


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
