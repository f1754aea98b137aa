"""The clips of a pass, scored by Algorithm 1, and the choice of the one that is danced."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import yaml

from robojackson.clips.quality.stability import Stability
from robojackson.errors import NoPersonFound, RoboJacksonError, UnreadableVideo
from robojackson.files.json_types import to_json_types
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.rl.config.train_config import longer_budgets
from robojackson.rl.evaluation.verdict import longer_minutes
from robojackson.robot.model import RobotDescription
from storage import artifact_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.detect_landmarks import detect_landmarks
from tasks.probe_video import SourceFile, probe_video
from tasks.runtime.run_logger import run_logger
from tasks.runtime.stage import Stage
from tasks.score_stability import score_stability
from tasks.write_page import PageSettings, ScoredClip

Input = TypeVar("Input")


@dataclass(frozen=True)
class Candidate:
    """A clip that may be danced.

    Attributes:
        name: Name of the file.
        clip: Its video and what is known of it, as `probe_video` left them.
        stability, score: Stability and score of Algorithm 1, as artifact and as value.
        begin_s: Where the clip begins in its video, seconds.
    """

    name: str
    clip: dict[str, Artifact]
    stability: Artifact
    score: Stability
    begin_s: float = 0.0


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
        Candidate(
            path.name, clip, score, artifact_tables.read(Stability, store, score), start_s or 0.0
        )
        for (((path, _), clip), _), score in scores
    ]


def choose(candidates: list[Candidate]) -> Candidate:
    """Return the steadiest candidate in which there is a person: the lowest score a second.

    Raises:
        NoPersonFound: no candidate shows a person.
    """
    danced = [candidate for candidate in candidates if candidate.score.detected]
    if not danced:
        frames = {candidate.name: candidate.score.frames for candidate in candidates}
        reasons = (f"{name}: no person found in {n} of {n} frames" for name, n in frames.items())
        raise NoPersonFound("; ".join(reasons))
    return min(danced, key=lambda candidate: candidate.score.score_per_second)


def longer_options(settings: PipelineConfig) -> str:
    """Return the options of a pass whose training is longer: its own budgets, where it has some,
    since the minutes of the pass do not count beside them."""
    longer = [f"--set {key}={value}" for key, value in longer_budgets(settings.train).items()]
    return " ".join(longer) or f"--minutes {longer_minutes(settings.minutes):g}"


def page_settings(
    best: Candidate,
    candidates: Sequence[Candidate],
    robot: RobotDescription,
    settings: PipelineConfig,
) -> PageSettings:
    """Return what a page needs besides what the stages make, with a reason for every candidate."""
    return PageSettings(
        robot,
        settings.render,
        yaml.safe_dump(to_json_types(settings), sort_keys=False),
        tuple(
            ScoredClip(
                each.name,
                each.clip["video"],
                _reason(each, best, len(candidates) == 1),
                each is best,
            )
            for each in candidates
        ),
        longer_options(settings),
        best.begin_s,
    )


def _reason(candidate: Candidate, best: Candidate, alone: bool) -> str:
    score, least = candidate.score.score_per_second, best.score.score_per_second
    if not candidate.score.detected:
        return "no person is visible in it"
    if candidate is best:
        why = "the only clip" if alone else "the steadiest"
        return f"danced: {why}, stability score {score:.2f} a second"
    return f"not danced: stability score {score:.2f} a second, {least:.2f} is steadier"


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
