"""The main flow: a dance in, a robot that dances it out, and a page that shows it.

Entry point of the deployment: `flows.dance.dance`. Which stages run and in which order stands here
and nowhere else; how a stage works is `robojackson`'s, how it is cached is `tasks`'.
"""

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from prefect import flow, unmapped
from prefect.artifacts import acreate_table_artifact
from prefect.logging import get_run_logger

from configs.loader import load
from configs.pipeline import PipelineConfig
from flows.chain import to_reference
from flows.intake import Minutes, Search, Seconds, Source, videos_of
from flows.launch import launch
from flows.scorers import scorers
from flows.single import VERDICT
from robojackson.clips.stability import Stability
from robojackson.errors import NoPersonFound, RoboJacksonError, UnreadableVideo
from robojackson.retarget.robot import RobotDescription
from robojackson.retarget.scorecard import check
from storage import catalogue, tables
from storage.artifact import Artifact
from storage.leftovers import sweep
from storage.store import Store
from tasks.evaluate import evaluate
from tasks.landmarks import landmarks
from tasks.page import page
from tasks.probe import SourceFile, probe
from tasks.stability import stability
from tasks.train import RunLabels, train
from tasks.video import video

Artifacts = dict[str, Artifact]
Input = TypeVar("Input")
LAST_STAGES_MINUTES = 1.5
"""What evaluation, video and page take; training ends early rather than run into it."""


@dataclass(frozen=True)
class Candidate:
    """A clip that may be danced.

    Attributes:
        name: Of the file.
        clip: Its video and what is known of it, as `probe` left them.
        stability, score: Of Algorithm 1, as artifact and as value.
    """

    name: str
    clip: Artifacts
    stability: Artifact
    score: Stability


def run(
    source: str,
    config: str,
    overrides: Mapping[str, Any],
    start_s: float | None = None,
    end_s: float | None = None,
) -> dict[str, Any]:
    """The flow from the command line: no tracebacks for what is the input's fault.

    Raises:
        DeploymentFailed: the server that is named does not answer, or refuses us.
        Interrupted: Ctrl-C; every stage that has ended is kept, and training left a checkpoint.
    """
    return launch(dance, source, config, dict(overrides), start_s, end_s)


@flow(name="dance", flow_run_name="dance-{source}", task_runner=scorers())
async def dance(
    source: Source,
    config: str = "base",
    overrides: dict[str, Any] | None = None,
    start_s: Seconds | None = None,
    end_s: Seconds | None = None,
    minutes: Minutes | None = None,
    search: Search = Search(),  # noqa: B008 (frozen)
) -> dict[str, Any]:
    """From the name of a dance, or a video of it, to a robot that dances it.

    Args:
        source: Name of a dance, as APT; or address of a video on the web; or path, where the worker
            is, of a video or of a folder of them, of which the steadiest is danced.
        config: Name or path of the pipeline's configuration.
        overrides: Values of it by key path, as robot or train.seed.
        start_s, end_s: Range of the video, seconds.
        minutes: Budget of the whole pass; that of the configuration if absent.
        search: How a dance is looked for that is given by its name.
    """
    store = Store.from_environment()
    sweep(store, work=False)
    given = {**(overrides or {}), **({} if minutes is None else {"minutes": minutes})}
    settings = load(PipelineConfig, config, given)
    robot = load(RobotDescription, f"robots/{settings.robot}")
    async with videos_of(source, search) as paths:
        began = time.time()  # what a search takes is no part of the budget
        candidates = await score_all(paths, settings, start_s, end_s)
    best = choose(candidates)
    labels = RunLabels(*map(catalogue.safe_name, (Path(best.name).stem, settings.setup)))
    made = await perform(best, robot, settings, labels, began)
    return await conclude(store, made, candidates, settings, labels)


async def score_all(
    paths: tuple[Path, ...],
    settings: PipelineConfig,
    start_s: float | None,
    end_s: float | None,
) -> list[Candidate]:
    """Algorithm 1 over all candidates; one that cannot be scored is left out.

    Raises:
        RoboJacksonError: none can be scored; why the first cannot.
    """
    paths, sources = _there(paths)
    limits = unmapped(settings.video)
    clips = _done(paths, probe.map(sources, limits, unmapped(start_s), unmapped(end_s)))
    tracks = _done(
        clips,
        landmarks.map(
            [clip["video"] for _, clip in clips],
            [clip["info"] for _, clip in clips],
            unmapped(settings.scoring_detector),
            unmapped(settings.dancer if settings.dancer.number else None),
        ),
    )
    steady = unmapped(settings.stability)
    scores = _done(tracks, stability.map([track for _, track in tracks], steady))
    store = Store.from_environment()
    return [
        Candidate(path.name, clip, score, tables.read(Stability, store, score))
        for ((path, clip), _), score in scores
    ]


def choose(candidates: list[Candidate]) -> Candidate:
    """The steadiest candidate in which there is a person.

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
    """Every stage after the choice, in order."""
    moved = to_reference(best.clip, robot, settings)
    reference = moved["reference"]
    if settings.gate:
        check(json.loads(Store.from_environment().read(moved["scorecard"].key)))
    deadline = began + 60 * (settings.minutes - LAST_STAGES_MINUTES)
    trained = await train(reference, robot, _budgeted(settings), labels, deadline)
    judged = evaluate(trained["policy"], reference, robot, settings.evaluate, labels)
    seen = (best.clip["video"], moved["landmarks"], moved["smpl"], reference, judged["rollout"])
    film = video(*seen, robot, settings.show)
    made = {**best.clip, "stability": best.stability, **moved}
    made |= {**trained, **judged, "dance": film}
    return {**made, **page(made, labels.move, best.name)}


async def conclude(
    store: Store,
    made: Artifacts,
    candidates: list[Candidate],
    settings: PipelineConfig,
    labels: RunLabels,
) -> dict[str, Any]:
    """Tables for Prefect's pages, a line in the catalogue, and the answer."""
    summary = json.loads(store.read(made["evaluation"].key))
    scorecard = json.loads(store.read(made["scorecard"].key))
    await acreate_table_artifact(key="scorecard", table=_rows(scorecard))
    await acreate_table_artifact(key="evaluation", table=_verdicts(summary))
    seed = settings.train.seed
    run_id = f"{labels.move}-{labels.setup}-s{seed}-{made['policy'].sha256[:8]}"
    names = {"run_id": run_id, "move": labels.move, "robot": settings.robot}
    when = datetime.now(UTC)
    entry = catalogue.Run(
        **names, setup=labels.setup, seed=seed, finished_at=when, artifacts=made, summary=summary
    )
    catalogue.record(store, entry)
    return {
        "page": store.address(made["page"].key),
        "video": store.address(made["dance"].key),
        **names,
        "candidates": {c.name: c.score.stability_score for c in candidates},
        "scorecard": scorecard,
        "evaluation": summary,
        "artifacts": {name: store.address(artifact.key) for name, artifact in made.items()},
    }


def _budgeted(settings: PipelineConfig) -> Any:
    """The training's configuration with what the pass leaves it, unless it says itself."""
    config = settings.train
    if config.has_budget:
        if (config.minutes or 0.0) > settings.train_minutes:
            get_run_logger().warning(
                "train.minutes=%g is more than minutes=%g leave it: it may be cut short",
                config.minutes,
                settings.minutes,
            )
        return config
    return replace(config, minutes=settings.train_minutes)


def _there(paths: Sequence[Path]) -> tuple[tuple[Path, ...], list[SourceFile]]:
    """The files that can be read.

    Raises:
        UnreadableVideo: none can; why the first cannot.
    """
    found, causes = [], []
    for path in paths:
        try:
            found.append((path, SourceFile.at(path)))
        except OSError as cause:
            causes.append(UnreadableVideo(f"{path}: cannot be read ({cause.strerror})"))
            get_run_logger().warning("%s", causes[-1])
    if not found:
        raise causes[0]
    return tuple(path for path, _ in found), [source for _, source in found]


def _done(inputs: Sequence[Input], futures: Any) -> list[tuple[Input, Any]]:
    """Inputs with their results, in order, without those whose own fault it is that there is none.

    Raises:
        RoboJacksonError: there is no result; the first cause.
        Exception: a failure that no input has caused.
    """
    made, causes = [], []
    for given, future in zip(inputs, futures, strict=True):
        result = future.result(raise_on_failure=False)
        if isinstance(result, RoboJacksonError):
            get_run_logger().warning("%s", result)
            causes.append(result)
        elif isinstance(result, BaseException):
            raise result
        else:
            made.append((given, result))
    if not made:
        raise causes[0]
    return made


def _rows(figures: Mapping[str, Any]) -> list[dict[str, Any]]:
    return [{"figure": name, "value": value} for name, value in figures.items()]


def _verdicts(summary: Mapping[str, Any]) -> list[dict[str, Any]]:
    """One row a policy."""
    policies = {"trained": summary, **summary["baselines"]}
    return [
        {"policy": name, **{key: figures.get(key) for key in VERDICT}}
        for name, figures in policies.items()
    ]
