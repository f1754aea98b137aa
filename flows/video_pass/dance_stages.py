"""One pass from clips to a page: its stages in order. No Prefect at import.

Inside the flow `dance` the stages run as cached tasks. Inside `tasks.runtime.stage.records_only`
the same pass is answered from the records of an earlier one.
"""

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from flows.video_pass.motion_stages import to_reference
from flows.video_pass.pass_progress import announce
from flows.video_pass.scored_candidates import Candidate, choose, page_settings, score_all
from flows.video_pass.time_budget import training_time
from flows.video_pass.tracker_stages import (
    TrackedDance,
    at_the_tempo_it_holds,
    chosen_tracker,
    track,
)
from robojackson.clips.quality.advice import advise
from robojackson.errors import RejectedReference
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.run_names import run_name
from robojackson.retarget.scorecard_gate import check
from robojackson.rl.config.train_config import TrainConfig
from robojackson.robot.model import RobotDescription
from storage import artifact_tables, run_catalogue, study_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.draw_pictures import draw_snapshot
from tasks.evaluate_dance import evaluate_dance
from tasks.publish_tables import place_of_pass
from tasks.render_video import render_video
from tasks.runtime.stage import labelled
from tasks.train_policy import RunLabels, train_policy
from tasks.write_page import joined_evaluation, write_page

Artifacts = dict[str, Artifact]
Facts = dict[str, Any]
SPOILING = ("head_down", "body_outside", "person_missing")
"""Kinds of advice that may explain why the gate refuses a motion."""


@dataclass(frozen=True)
class DanceResult:
    """A pass that has ended.

    Attributes:
        answer: The answer of the command.
        artifacts: What the stages left, by name.
    """

    answer: Facts
    artifacts: Artifacts


async def make_dance(
    store: Store,
    paths: tuple[Path, ...],
    settings: PipelineConfig,
    start_s: float | None = None,
    end_s: float | None = None,
) -> DanceResult:
    """Dance the steadiest of some videos.

    Args:
        paths: Paths of the videos.
        start_s, end_s: Range of each, seconds.
    Raises:
        NoPersonFound: no person is in any of them.
        RejectedReference: the gate refuses the motion.
        RoboJacksonError: a stage cannot do its work; the message names the cause.
    """
    robot = describe_robot(settings.robot)
    began = time.time()  # what a search takes is no part of the budget
    announce("scoring")
    candidates = score_all(paths, settings, start_s, end_s)
    best = choose(candidates)
    labels = RunLabels(*map(run_name, (Path(best.name).stem, settings.setup)))
    made = await perform(best, candidates, robot, settings, labels, began)
    return DanceResult(conclude(store, made, candidates, settings, labels), made)


async def perform(
    best: Candidate,
    candidates: Sequence[Candidate],
    robot: RobotDescription,
    settings: PipelineConfig,
    labels: RunLabels,
    began: float,
) -> Artifacts:
    """Run every stage after the choice, in order; where there is a tracker, it dances first.

    Args:
        candidates: All that were scored.
        labels: Names of the dance and the setup.
        began: When the budget of the pass began, Unix time, seconds.
    """
    tracker = chosen_tracker(robot, settings)
    with labelled(labels.move):
        announce("motion capture and retargeting")
        moved = to_reference(best.clip, robot, settings)
        if settings.gate:
            _require_feasible(moved, best.begin_s)
        shown = page_settings(best, candidates, robot, settings)
        tracked = None
        if tracker is not None:
            if settings.instant:
                moved = at_the_tempo_it_holds(tracker, best.clip, moved, robot, settings, labels)
            tracked = track(tracker, best, moved, robot, settings, labels, shown)
        if tracked is not None and settings.instant:
            made = tracked.made
        else:
            made = await _trained(best, moved, robot, settings, labels, began, tracked)
        folder = "" if tracked is None else tracked.folder
        evaluation = json.loads(Store.from_environment().read(made["evaluation"].key))
        place = place_of_pass(made, labels, evaluation.get("tracker"), settings.train.seed)
        return {**made, **write_page(made, place, best.name, shown, folder)}


def _require_feasible(moved: Artifacts, begin_s: float) -> None:
    """Apply the gate; a refusal names what in the clip may be the reason."""
    store = Store.from_environment()
    try:
        check(json.loads(store.read(moved["scorecard"].key)))
    except RejectedReference as cause:
        track = artifact_tables.read(LandmarkTrack, store, moved["landmarks"])
        reasons = [str(each) for each in advise(track, begin_s) if each.kind in SPOILING]
        raise cause.advised(reasons) from None


async def _trained(
    best: Candidate,
    moved: Artifacts,
    robot: RobotDescription,
    settings: PipelineConfig,
    labels: RunLabels,
    began: float,
    tracked: TrackedDance | None,
) -> Artifacts:
    """Train, evaluate and film a policy; what a tracker danced stays beside it."""
    reference = moved["reference"]
    announce("training")
    config, whole_pass = _budgeted(settings)
    trained = await train_policy(
        reference, robot, config, labels,
        time_left=training_time(reference, robot, settings, began), whole_pass=whole_pass,
    )  # fmt: skip
    announce("evaluation")
    evaluated = evaluate_dance(trained["policy"], reference, robot, settings.evaluate, labels)
    shown = (best.clip["video"], moved["landmarks"], moved["smpl"], reference)
    announce("video")
    film = render_video(*shown, evaluated["rollout"], robot, settings.render)
    made = {**best.clip, "stability": best.stability, **moved, **trained, **evaluated}
    beside = {} if tracked is None else tracked.joined
    return made | {"dance": film, "still": draw_snapshot(film), **beside}


def conclude(
    store: Store,
    made: Artifacts,
    candidates: list[Candidate],
    settings: PipelineConfig,
    labels: RunLabels,
) -> Facts:
    """Add the pass to the catalogue of runs and the tables, and return its answer."""
    summary, robot = joined_evaluation(store, made), describe_robot(settings.robot).name
    place = place_of_pass(made, labels, summary.get("tracker"), settings.train.seed)
    track = artifact_tables.read(LandmarkTrack, store, made["landmarks"])
    when = datetime.now(UTC)
    names = {"run_id": place.run_id, "move": place.move, "robot": robot}
    entry = run_catalogue.Run(
        **names, setup=place.setup, seed=place.seed, finished_at=when, artifacts=made,
        summary=summary,
    )  # fmt: skip
    run_catalogue.record(store, entry)
    beats = json.loads(store.read(made["beats"].key))["figures"] if "beats" in made else None
    if beats is not None:
        rows = [{"robot": robot, "motion": name, **one} for name, one in beats.items()]
        study_tables.write_beats(store, place, rows)
    return {
        "page": store.address(made["page"].key),
        "video": store.address(made["dance"].key),
        "live": store.address(made["live"].key) if "live" in made else None,
        **names,
        "candidates": {c.name: c.score.score_per_second for c in candidates},
        "scorecard": json.loads(store.read(made["scorecard"].key)),
        "evaluation": summary,
        "beats": beats,
        "advice": [each.record for each in advise(track, choose(candidates).begin_s)],
        "artifacts": {name: store.address(artifact.key) for name, artifact in made.items()},
    }


def _budgeted(settings: PipelineConfig) -> tuple[TrainConfig, bool]:
    """Return the training's configuration, and whether its budget is that of the whole pass."""
    config = settings.train
    if config.has_budget:
        return config, False
    return replace(config, minutes=settings.minutes), True
