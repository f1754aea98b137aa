"""Polish: a training that begins with what the feedback alone does and improves it.

Which trainings do (`polishes`), the numbers of TQC that they learn with (`residual_learning`), and
the environment that pays them (`paid_environment`). `docs/learning_g1.md` has what was measured.
"""

import logging
from collections.abc import Sequence
from dataclasses import replace

from robojackson.motion.reference_motion import ReferenceMotion, motions_of
from robojackson.rl.config.tqc_config import PRESETS
from robojackson.rl.config.train_config import PaperConfig, TqcConfig, TrackConfig, TrainConfig
from robojackson.rl.feedback.cached_feedback import feedback_of
from robojackson.rl.feedback.sampled_regulator import ENOUGH
from robojackson.rl.modes.track_mode import control_of, is_fed
from robojackson.rl.sim.motors import feedback_path
from robojackson.rl.walkers import SCRATCH
from robojackson.robot.model import Robot

log = logging.getLogger(__name__)

POLISHED = ENOUGH
"""Share of the starts from which the feedback alone holds a motion that repeats, for it to be
polished; where a path holds so many, no better one is searched."""
ESTIMATED_PENALTY = 0.03
"""Cost of actions of a polish on feedback from an estimated root, which alone holds less: a policy
has more to correct (docs/learning_g1.md, "On its own measurements")."""


def held_alone(
    config: TrainConfig, robot: Robot, reference: ReferenceMotion | Sequence[ReferenceMotion]
) -> float:
    """Return the share of the starts from which the feedback of a training alone keeps robots
    upright, 0..1; NaN where it has none, or that is unknown."""
    if not is_fed(config, robot.description):
        return float("nan")
    law = feedback_of(robot, motions_of(reference), control_of(config.track))
    return float("nan") if law is None else law.held


def paid_environment(
    config: TrainConfig,
    robot: Robot,
    reference: ReferenceMotion | Sequence[ReferenceMotion],
    held: float,
) -> TrackConfig | PaperConfig:
    """Return the environment that a training pays: a polish's has narrower bells.

    Args:
        held: As of `residual_learning`.
    """
    if config.tqc.preset == "polish" or polishes(config, robot, reference, held):
        return sharper(config.environment)
    return config.environment


def sharper(environment: TrackConfig | PaperConfig) -> TrackConfig | PaperConfig:
    """Return the environment of a polish, whose narrower bells pay more, and for the last
    millimetres: where the feedback already dances, the usual ones are nearly all paid
    (docs/learning_g1.md, "Narrower bells")."""
    if not isinstance(environment, TrackConfig):
        return environment
    reward = environment.reward
    narrow = min(reward.narrow, reward.polished_narrow)
    fine = max(reward.fine, reward.polished_fine)
    return replace(environment, reward=replace(reward, narrow=narrow, fine=fine))


def polishes(
    config: TrainConfig,
    robot: Robot,
    reference: ReferenceMotion | Sequence[ReferenceMotion],
    held: float,
) -> bool:
    """Return whether a training begins with what the feedback alone does (`residual_learning`)."""
    track, motions = config.track, motions_of(reference)
    usual = config.trainer == "sbx" and config.start == SCRATCH
    path = feedback_path(robot, control_of(track))
    fed = is_fed(config, robot.description) and path == "sampled"
    better = len(motions) == 1 and (held >= POLISHED or not motions[0].cyclic)
    chosen = config.polish == "auto" and config.tqc.preset == "dance" and not track.random.pushes
    return usual and chosen and fed and better


def residual_learning(
    config: TrainConfig,
    robot: Robot,
    reference: ReferenceMotion | Sequence[ReferenceMotion],
    held: float,
) -> TqcConfig:
    """Return TQC's configuration: the given one, where the feedback dances by itself with the
    numbers of `polish` for those that were not given.

    A motion that repeats is learnt better from falls, by actions that are random at first, unless
    the feedback holds nine tenths; they destroy what it holds of one that ends
    (docs/learning_g1.md).

    Args:
        config: The training.
        robot: The robot.
        reference: Its motion or motions.
        held: Share of the starts from which the feedback alone keeps robots upright, 0..1, or NaN.
    """
    if not polishes(config, robot, reference, held):
        return config.tqc
    log.info("improving what the feedback alone does (train.polish=no: begin with random actions)")
    preset = dict(PRESETS["polish"])
    if control_of(config.track).root_state == "estimated":
        preset["action_penalty"] = ESTIMATED_PENALTY
    unset = {name: x for name, x in preset.items() if getattr(config.tqc, name) is None}
    return replace(config.tqc, **unset)
