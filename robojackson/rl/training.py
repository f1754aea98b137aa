"""Training: one function for both modes and every trainer, which can resume at any moment.

`out/checkpoint/` and `out/replay/` are the only state; the same call with the same configuration
continues from it, and ends as if it had never stopped. `out/policy.safetensors` is always the
newest whole policy; of a polish that is over, the feedback alone where that is better. During
training the caller receives rows (episodes) and progress dictionaries; the caller writes the
tables.
"""

import logging
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

from robojackson.errors import BadConfiguration, BadPolicy
from robojackson.motion.reference_motion import ReferenceMotion, motions_of
from robojackson.rl.checkpoint_folder import NETWORKS, newest_checkpoint, require_free
from robojackson.rl.config.track_config import RandomConfig
from robojackson.rl.config.train_config import TqcConfig, TrainConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.env.vec_env import TrackingVecEnv
from robojackson.rl.evaluation.polish_choice import BESIDE, better_of
from robojackson.rl.policy import load_policy
from robojackson.rl.polish import held_alone, paid_environment, residual_learning
from robojackson.rl.pretrained import pretrained
from robojackson.rl.start_law import require_same_law
from robojackson.rl.tqc.network_arrays import (
    Networks,
    chosen,
    fitted,
    load_networks,
    widened,
    with_exploration,
)
from robojackson.rl.tqc.trainer import Trainer
from robojackson.rl.tqc.trainers import make_trainer
from robojackson.rl.training_hooks import BudgetSpent, Choice, Hooks, as_trained
from robojackson.rl.training_run import Run
from robojackson.rl.training_task import Task, TrainResult
from robojackson.rl.walkers import SCRATCH
from robojackson.robot.model import Robot

__all__ = ["Hooks", "TrainResult", "train_policy"]

log = logging.getLogger(__name__)


def train_policy(
    reference: ReferenceMotion | Sequence[ReferenceMotion],
    robot: Robot,
    config: TrainConfig,
    out: Path,
    hooks: Hooks | None = None,
) -> TrainResult:
    """Train a policy to follow a reference motion, or several.

    Raises:
        BadConfiguration: the configuration has no budget.
        BadPolicy: the networks to start from do not fit.
        TrainingDiverged: networks hold values that are not finite; the last checkpoint stays.
        KeyboardInterrupt: after a checkpoint was written.
    """
    if not config.has_budget:
        raise BadConfiguration("training needs a budget: steps, minutes or cpu_minutes")
    hooks = hooks or Hooks()
    require_free(out)
    networks = _start(config, robot, out)
    out.mkdir(parents=True, exist_ok=True)
    held = held_alone(config, robot, reference)
    environment = paid_environment(config, robot, reference, held)
    hooks.paying(environment)
    of_tqc = (config.tqc.n_envs, config.seed)
    core = TrackingCore(robot, reference, environment, *of_tqc, hooks.rewards)
    run = Run(out, config, core, Task.of(reference, robot), hooks)
    env = TrackingVecEnv(core, run.episodes)
    if networks is None:
        tqc = residual_learning(config, robot, reference, held)
    else:
        networks, tqc = _fitting(networks, core, config, robot)
    _warn_of_short_budget(tqc, config.steps)
    seen = core.actor_size if core.actor_size < core.observation_size else None
    trainer = make_trainer(config.trainer, env, tqc, config.seed, seen)
    if networks is not None:
        started = chosen(networks, config.start_critics)
        if not (tqc.gsde and config.trainer == "sb3"):  # whose noise has no such head
            started = with_exploration(started, tqc.actor_start.log_std_init)
        trainer.start_from(started.tensors)
    run.bind(trainer)
    choice = _choice(tqc, config, reference, robot, core)
    if run.finished() and newest_checkpoint(out) is not None:
        log.warning("no step is added: the %s are used up; give a larger budget", run.finished())
    try:
        if not run.finished():
            _learn(trainer, run)
        elif newest_checkpoint(out) is None or (choice is not as_trained and not _is_chosen(out)):
            run.checkpoint(choice)
    except BudgetSpent:
        run.checkpoint(choice)
    finally:
        env.close()
    result = run.result()
    _warn_of_no_learning(tqc, config.steps, result.steps)
    return result


def _learn(trainer: Trainer, run: Run) -> None:
    """Learn until the budget is used up.

    Raises:
        TrainingDiverged: also within a round, where torch refuses a distribution of NaN.
    """
    try:
        trainer.learn(run.callback)
    except ValueError:
        run.require_finite()
        raise


def _start(config: TrainConfig, robot: Robot, out: Path) -> Networks | None:
    """Return the networks that a training begins with; where it goes on, those of its checkpoint,
    so that the file of its start may be gone."""
    own = out / NETWORKS
    if config.start != SCRATCH and newest_checkpoint(out) is not None and own.is_file():
        return load_networks(own)
    return pretrained(config.start, config.mode, robot.description)


def _is_chosen(out: Path) -> bool:
    """Return whether a polish whose budget is used up was tried beside the feedback alone; not
    where it was stopped in its last moment."""
    policy = out / "policy.safetensors"
    return policy.is_file() and BESIDE in load_policy(policy).facts


def _choice(
    tqc: TqcConfig,
    config: TrainConfig,
    reference: ReferenceMotion | Sequence[ReferenceMotion],
    robot: Robot,
    core: TrackingCore,
) -> Choice:
    """Return what a polish is written by: the policy or, if that holds more, the feedback alone."""
    motions, threads = motions_of(reference), core.config.threads
    disturbed = config.track.random != RandomConfig()
    if not tqc.actor_start.zero_init or len(motions) > 1 or disturbed:
        return as_trained
    return partial(better_of, reference=motions[0], robot=robot, clip=core.clip, threads=threads)


def _warn_of_short_budget(tqc: TqcConfig, steps: int | None) -> None:
    """Log a warning where the actor would never learn."""
    burn_in = tqc.actor_start.burn_in
    if steps is not None and 0 < burn_in >= steps:
        log.warning(
            "the critics learn alone for %s transitions (tqc.burn_in) and the budget is %s: the "
            "policy stays as it begins",
            f"{burn_in:,}",
            f"{steps:,}",
        )


def _warn_of_no_learning(tqc: TqcConfig, steps: int | None, done: int) -> None:
    """Log a warning where a training ended before its actor learnt, unless its budget in steps
    gave one at the beginning."""
    start = tqc.actor_start
    if done >= start.burn_in or (steps is not None and steps <= start.burn_in):
        return
    log.warning(
        "the training ended after %s transitions, and until %s the critics learn alone "
        "(tqc.burn_in): the policy is %s; give it more minutes",
        f"{done:,}",
        f"{start.burn_in:,}",
        "the feedback alone" if start.zero_init else "as it began",
    )


def _fitting(
    networks: Networks, core: TrackingCore, config: TrainConfig, robot: Robot
) -> tuple[Networks, TqcConfig]:
    """Return the networks, which must fit, and TQC's configuration with their layers; a policy's
    actor gets inputs for what the critics alone see, as the trainers keep it."""
    learnt = networks.facts.get("environment")
    kind = learnt.get("observation", "full") if isinstance(learnt, Mapping) else None
    if config.mode == "track" and kind not in (None, config.track.observation):
        raise BadPolicy(
            f"start {config.start!r} observes {kind} and this training "
            f"{config.track.observation}, in another order: --set track.observation={kind}"
        )
    require_same_law(networks, core.sim.control, robot, config.start)
    seen = core.actor_size if networks.is_policy else core.observation_size
    found = (networks.observation_size, networks.action_size)
    needed = (seen, core.action_size)
    if found != needed:
        raise BadPolicy(
            f"start {config.start!r} takes {found[0]} observations and gives {found[1]} actions; "
            f"mode {config.mode} has {needed[0]} and {needed[1]}"
        )
    tqc = fitted(config.tqc, networks, config.start_critics)
    if tqc != config.tqc:
        log.info("layers as in %s: actor %s, critics %s", config.start, tqc.actor, tqc.critic)
    return widened(networks, core.observation_size) if networks.is_policy else networks, tqc
