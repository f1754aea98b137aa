"""Stages of a tracker's dance: a first look on the page, then the video and the full evaluation.

The page is written before anything is filmed, evaluated further or trained, and again when more is
known, at the same address.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace

from flows.video_pass.motion_stages import to_reference
from flows.video_pass.pass_progress import announce
from flows.video_pass.scored_candidates import Candidate
from flows.video_pass.slower_dance import slower_where_it_falls
from robojackson.errors import BadPolicy, MissingDependency
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.tracker_descriptions import require_tracker
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.model import RobotDescription
from storage.artifact import Artifact
from storage.store import Store
from tasks.draw_pictures import draw_snapshot
from tasks.evaluate_dance import evaluate_tracker, first_look
from tasks.publish_tables import place_of_pass
from tasks.render_video import render_video
from tasks.runtime.run_logger import run_logger
from tasks.runtime.stage import identity, is_records_only
from tasks.train_policy import RunLabels
from tasks.write_page import PageSettings, write_early_page

Artifacts = dict[str, Artifact]
FILM = "tracker.mp4"
TITLE = "tracker {}"
"""Over the tracker's panel of the film."""
FIRST_PAGE = "the tracker's dance is on %s; what follows is added there"
"""Log line with the address of the page, which the bar of `robojackson dance` shows as well."""
JOINED = {"evaluation": "tracker_evaluation", "dance": "tracker_dance"}
"""What of a tracker stays beside a trained policy, by its name alone and by its name there."""


@dataclass(frozen=True)
class TrackedDance:
    """A dance that a tracker has danced.

    Attributes:
        tracker: Description of the tracker.
        made: What its stages left, by the names that a trained policy's have.
        folder: Folder of the page.
    """

    tracker: TrackerDescription
    made: Artifacts
    folder: str

    @property
    def joined(self) -> Artifacts:
        """The part of it that stays on the page of a trained policy."""
        return {there: self.made[alone] for alone, there in JOINED.items()}


def chosen_tracker(robot: RobotDescription, settings: PipelineConfig) -> TrackerDescription | None:
    """Return the tracker that dances at once; None where there is none and none is needed: before a
    training, a fallback is taken by name alone.

    Raises:
        BadPolicy: `instant` needs a tracker that is not installed, or none exists for the robot.
        MissingDependency: `instant` needs one, and what runs it is not installed.
        UnknownName: no tracker of that name.
    """
    try:
        found = require_tracker(robot.name, settings.tracker)
    except (BadPolicy, MissingDependency):
        if settings.instant:
            raise
        return None
    unasked = found is not None and found.fallback and settings.tracker is None
    return None if unasked and not settings.instant else found


def at_the_tempo_it_holds(
    tracker: TrackerDescription,
    clip: Artifacts,
    moved: Artifacts,
    robot: RobotDescription,
    settings: PipelineConfig,
    labels: RunLabels,
) -> Artifacts:
    """Return the retargeted clip of an instant dance, slowed down where the tracker falls and the
    tempo is not given.

    Args:
        clip: `video` and `info`.
        moved: The clip at its own tempo: `landmarks`, `smpl`, `reference` and `scorecard`.
    """
    if settings.retarget.tempo != "auto" or not settings.instant_tempos:
        return moved

    def retargeted(tempo: float) -> Artifacts:
        announce(f"retargeting at tempo {tempo:g}")
        at_once = replace(settings, retarget=replace(settings.retarget, tempo=tempo))
        return to_reference(clip, robot, at_once)

    def look(motion: Artifacts) -> float:
        announce("tracking")
        config = first_look(settings.evaluate)
        found = evaluate_tracker(tracker, motion["reference"], robot, config, labels)
        verdict = json.loads(Store.from_environment().read(found["evaluation"].key))
        strict = verdict["strict_success"]
        return 1.0 if strict is None else float(strict)  # null: too short an evaluation to tell

    return slower_where_it_falls(moved, settings.instant_tempos, retargeted, look, settings.gate)


def track(
    tracker: TrackerDescription,
    best: Candidate,
    moved: Mapping[str, Artifact],
    robot: RobotDescription,
    settings: PipelineConfig,
    labels: RunLabels,
    shown_with: PageSettings,
) -> TrackedDance:
    """Dance, show it, then film it and evaluate it from all starts.

    Args:
        moved: `landmarks`, `smpl`, `reference` and `scorecard` of the clip.
        shown_with: What the page needs besides.
    """
    reference = moved["reference"]
    announce("tracking")
    look = evaluate_tracker(tracker, reference, robot, first_look(settings.evaluate), labels)
    made = {**best.clip, "stability": best.stability, **moved, **look}
    folder = _folder(made, tracker, robot, settings, labels)
    page, place = None, place_of_pass(made, labels, tracker.name, 0)
    if not is_records_only():
        page = write_early_page(made, place, best.name, shown_with, folder)
    if page is not None:
        run_logger().info(FIRST_PAGE, page)
    announce("video")
    shown = (best.clip["video"], moved["landmarks"], moved["smpl"], reference)
    title = TITLE.format(tracker.name)
    film = render_video(*shown, look["rollout"], robot, settings.render, title, FILM)
    announce("evaluation")
    evaluation = settings.evaluate  # a training that follows has the passport
    how = evaluation if settings.instant else replace(evaluation, passport=False)
    whole = evaluate_tracker(tracker, reference, robot, how, labels)
    made |= {**whole, "rollout": look["rollout"], "dance": film, "still": draw_snapshot(film)}
    if page is not None and not settings.instant:  # a training follows, which takes minutes
        place = place_of_pass(made, labels, tracker.name, 0)
        write_early_page(made, place, best.name, shown_with, folder, again=True)
    return TrackedDance(tracker, made, folder)


def _folder(
    made: Artifacts,
    tracker: TrackerDescription,
    robot: RobotDescription,
    settings: PipelineConfig,
    labels: RunLabels,
) -> str:
    """Return a folder for the page that is known before all that will be on it."""
    parts = [made["video"], made["reference"], tracker, robot, settings.train, settings.evaluate]
    parts += [settings.render, settings.minutes, settings.instant, labels]
    text = json.dumps(identity(parts), sort_keys=True)
    return f"dances/{labels.move}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"
