"""Minutes of a pass that remain for its training; no part of a cache key."""

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.rl.evaluation.duration import minutes_needed, seconds_to_evaluate
from robojackson.rl.modes.track_mode import is_fed
from robojackson.robot.model import RobotDescription, load_robot
from storage import artifact_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.stage import is_records_only
from tasks.train_policy import TrainingTime

PAGE_S, PICTURE_S = 4.0, 0.04
"""What page and pictures, and each picture of the video, take on one busy core, seconds."""


def training_time(
    reference: Artifact, robot: RobotDescription, settings: PipelineConfig, began: float
) -> TrainingTime | None:
    """Measure the time spent by the pass, and estimate the time after the training.

    Args:
        began: When the budget of the pass began, Unix time, seconds.

    Returns:
        None where every stage is answered from records.
    """
    if is_records_only():
        return None
    motion = artifact_tables.read(ReferenceMotion, Store.from_environment(), reference)
    machine = load_robot(robot)
    evaluation_s = seconds_to_evaluate(machine, motion, settings.evaluate)
    shown_s = min(
        max(settings.evaluate.seconds, len(motion) * motion.dt), settings.render.max_seconds
    )
    after_s = evaluation_s + PAGE_S + PICTURE_S * settings.render.fps * shown_s
    train = settings.train
    needed = minutes_needed(motion, is_fed(train, robot) and not train.track.random.pushes)
    return TrainingTime(began + 60 * settings.minutes - after_s, needed)
