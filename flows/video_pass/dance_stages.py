"""One pass from clips to a page: which stages run, and in which order. No Prefect at import.

Inside the flow `dance` the stages run as cached tasks. Inside `tasks.runtime.stage.records_only`
the same pass is answered from the records of an earlier one.
"""

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from flows.video_pass.motion_stages import to_reference
from robojackson.clips.quality.stability import Stability
from robojackson.errors import NoPersonFound, RoboJacksonError, UnreadableVideo
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.run_names import run_name
from robojackson.retarget.scorecard_gate import check
from robojackson.robot.model import RobotDescription
from storage import artifact_tables, run_catalogue
from storage.artifact import Artifact
from storage.store import Store
from tasks.detect_landmarks import detect_landmarks
from tasks.draw_pictures import draw_snapshot
from tasks.evaluate_dance import evaluate_dance
from tasks.probe_video import SourceFile, probe_video
from tasks.render_video import render_video
from tasks.runtime.run_logger import run_logger
from tasks.runtime.stage import Stage, labelled
from tasks.score_stability import score_stability
from tasks.train_policy import RunLabels, train_policy
from tasks.write_page import write_page

Artifacts = dict[str, Artifact]
Facts = dict[str, Any]
Input = TypeVar("Input")
LAST_STAGES_MINUTES = 1.5
"""What evaluation, video and page take; training ends early rather than run into it."""


@dataclass(frozen=True)
class Candidate:
    """A clip that may be danced.

    Attributes:
        name: Of the file.
        clip: Its video and what is known of it, as `probe_video` left them.
        stability, score: Of Algorithm 1, as artifact and as value.
    """

    name: str
    clip: Artifacts
    stability: Artifact
    score: Stability


@dataclass(frozen=True)
class DanceResult:
    """A pass that has ended.

    Attributes:
        answer: What the command says.
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
        paths: Of the videos.
        start_s, end_s: Range of each, seconds.
    Raises:
        NoPersonFound: nobody is in any of them.
        RejectedReference: the gate refuses the motion.
        RoboJacksonError: a stage cannot do its work; the message names the cause.
    """
    robot = describe_robot(settings.robot)
    began = time.time()  # what a search takes is no part of the budget
    candidates = score_all(paths, settings, start_s, end_s)
    best = choose(candidates)
    labels = RunLabels(*map(run_name, (Path(best.name).stem, settings.setup)))
    made = await perform(best, robot, settings, labels, began)
    return DanceResult(conclude(store, made, candidates, settings, labels), made)


def score_all(
    paths: tuple[Path, ...],
    settings: PipelineConfig,
    start_s: float | None,
    end_s: float | None,
) -> list[Candidate]:
    """Score all candidates by Algorithm 1; one that cannot be scored is left out.

    Raises:
        RoboJacksonError: none can be scored; why the first cannot.
    """
    dancer = settings.dancer if settings.dancer.number else None
    size = settings.scoring_detector
    readable = _readable(paths)
    clips = _each(probe_video, readable, lambda given: (given[1], settings.video, start_s, end_s))
    tracks = _each(
        detect_landmarks, clips, lambda given: (given[1]["video"], given[1]["info"], size, dancer)
    )
    scores = _each(score_stability, tracks, lambda given: (given[1], settings.stability))
    store = Store.from_environment()
    return [
        Candidate(path.name, clip, score, artifact_tables.read(Stability, store, score))
        for (((path, _), clip), _), score in scores
    ]


def choose(candidates: list[Candidate]) -> Candidate:
    """Return the steadiest candidate in which there is a person.

    Raises:
        NoPersonFound: there is none.
    """
    danced = [candidate for candidate in candidates if candidate.score.detected]
    if not danced:
        frames = {candidate.name: candidate.score.frames for candidate in candidates}
        told = (f"{name}: no person found in {n} of {n} frames" for name, n in frames.items())
        raise NoPersonFound("; ".join(told))
    return min(danced, key=lambda candidate: candidate.score.stability_score)


async def perform(
    best: Candidate,
    robot: RobotDescription,
    settings: PipelineConfig,
    labels: RunLabels,
    began: float,
) -> Artifacts:
    """Run every stage after the choice, in order.

    Args:
        labels: Names of the dance and the setup.
        began: When the budget of the pass began, Unix time, seconds.
    """
    with labelled(labels.move):
        moved = to_reference(best.clip, robot, settings)
        reference = moved["reference"]
        if settings.gate:
            check(json.loads(Store.from_environment().read(moved["scorecard"].key)))
        deadline = began + 60 * (settings.minutes - LAST_STAGES_MINUTES)
        trained = await train_policy(reference, robot, _budgeted(settings), labels, deadline)
        judged = evaluate_dance(trained["policy"], reference, robot, settings.evaluate, labels)
        shown = (best.clip["video"], moved["landmarks"], moved["smpl"], reference)
        film = render_video(*shown, judged["rollout"], robot, settings.render)
        made = {**best.clip, "stability": best.stability, **moved, **trained, **judged}
        made |= {"dance": film, "still": draw_snapshot(film)}
        return {**made, **write_page(made, labels.move, best.name)}


def conclude(
    store: Store,
    made: Artifacts,
    candidates: list[Candidate],
    settings: PipelineConfig,
    labels: RunLabels,
) -> Facts:
    """Add the pass to the catalogue of runs and return its answer."""
    summary = json.loads(store.read(made["evaluation"].key))
    seed = settings.train.seed
    run_id = f"{labels.move}-{labels.setup}-s{seed}-{made['policy'].sha256[:8]}"
    names = {"run_id": run_id, "move": labels.move, "robot": settings.robot}
    when = datetime.now(UTC)
    entry = run_catalogue.Run(
        **names, setup=labels.setup, seed=seed, finished_at=when, artifacts=made, summary=summary
    )
    run_catalogue.record(store, entry)
    return {
        "page": store.address(made["page"].key),
        "video": store.address(made["dance"].key),
        **names,
        "candidates": {c.name: c.score.stability_score for c in candidates},
        "scorecard": json.loads(store.read(made["scorecard"].key)),
        "evaluation": summary,
        "artifacts": {name: store.address(artifact.key) for name, artifact in made.items()},
    }


def _budgeted(settings: PipelineConfig) -> Any:
    """Return the training's configuration; its default budget is what is left of the pass."""
    config = settings.train
    if config.has_budget:
        if (config.minutes or 0.0) > settings.train_minutes:
            run_logger().warning(
                "train.minutes=%g is more than minutes=%g leave it: it may be cut short",
                config.minutes,
                settings.minutes,
            )
        return config
    return replace(config, minutes=settings.train_minutes)


def _readable(paths: Sequence[Path]) -> list[tuple[Path, SourceFile]]:
    """Return the files that can be read, with their digests.

    Raises:
        UnreadableVideo: none can; why the first cannot.
    """
    found, causes = [], []
    for path in paths:
        try:
            found.append((path, SourceFile.at(path)))
        except OSError as cause:
            causes.append(UnreadableVideo(f"cannot be read ({cause.strerror})", path))
            run_logger().warning("%s", causes[-1])
    if not found:
        raise causes[0]
    return found


def _each(
    stage: Stage[..., Any], inputs: Sequence[Input], call: Callable[[Input], tuple[Any, ...]]
) -> list[tuple[Input, Any]]:
    """Run a stage for every input; return the inputs with their results, in order.

    An input that is itself the cause of a failure is left out.

    Args:
        call: Input to the arguments of the stage.
    Raises:
        RoboJacksonError: no input is left; the first cause.
        Exception: a failure that no input has caused.
    """
    made, causes = [], []
    outcomes = stage.outcomes([call(given) for given in inputs])
    for given, result in zip(inputs, outcomes, strict=True):
        if isinstance(result, RoboJacksonError):
            run_logger().warning("%s", result)
            causes.append(result)
        elif isinstance(result, BaseException):
            raise result
        else:
            made.append((given, result))
    if not made:
        raise causes[0]
    return made
