"""Evaluate a policy: many starts on stock physics, beside baselines that do not dance.

24 phases x 3 noisy resets and the default stand, deterministic policy, one horizon each. Success is
the paper's: no fall (torso below 0.7 m or tilted over 60 degrees). Strict success also forbids
kneeling and a mean site error above 0.30 m at any step. Skill is relative to the best frozen pose
over 14 sites with hands and head; a fall counts 0. The velocity score (`metrics.dance_score`) is
measured along the heading: the only figure that detects a robot jumping from place to place.
"""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float

from robojackson.errors import BadPolicy
from robojackson.motion.floor_move import FloorMove
from robojackson.motion.reference_motion import ReferenceMotion, poses_sha256
from robojackson.rl.config.evaluate_config import TRAINED, VARIANTS
from robojackson.rl.config.train_config import (
    ControlConfig,
    EvaluateConfig,
    PaperConfig,
    TrackConfig,
)
from robojackson.rl.evaluation.controllers import (
    Evaluated,
    control_of,
    drivers,
    equipped,
    sees_ahead,
)
from robojackson.rl.evaluation.passport import passport, passport_facts
from robojackson.rl.evaluation.reward_audit import RewardAudit, audit_both_readings, audit_record
from robojackson.rl.evaluation.reward_meter import RewardMeter, without_curiosity
from robojackson.rl.evaluation.rollout_records import RolloutScorer
from robojackson.rl.evaluation.rollouts import Rollouts, Starts, roll_out
from robojackson.rl.evaluation.starts import starts_of, summarise
from robojackson.rl.evaluation.verdict import verdict_on, without_short_figures
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.modes.paper_mode import facing_ahead
from robojackson.rl.policy import Policy
from robojackson.rl.policy_facts import (
    OTHER_PATH,
    fact,
    is_of_another_motion,
    is_of_another_path,
    mode_of,
    networks_sha256,
)
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import control_step, require_same_clock
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot

log = logging.getLogger(__name__)

STATUE_SHARE = 0.9
"""Share of a run's own return above which a statue's return raises a flag."""


@dataclass(frozen=True)
class Evaluation:
    """The result of an evaluation.

    Attributes:
        summary: Means over the policy's rollouts, and those of the baselines by name; `verdict`:
            kind and sentence. Success and skill are None where that is `too_short`.
        rows: One row a rollout, of the policy and of every baseline.
        rollout_qpos: The policy's rollout from the clip's first step (phase 0, reset 0, with or
            without a fall), for the video; row s is the state at the reference's step s.
    """

    summary: dict[str, object]
    rows: list[dict[str, object]]
    rollout_qpos: Float[np.ndarray, "S nq"]


def evaluate_policy(
    policy: Evaluated,
    reference: ReferenceMotion,
    robot: Robot,
    config: EvaluateConfig,
    progress: Callable[[str, int, int], None] = lambda name, step, total: None,
) -> Evaluation:
    """Evaluate a policy or a tracker and its baselines on one reference motion.

    The baselines beside a tracker have the tracker's gains.

    Raises:
        BadPolicy: the policy's observation does not fit this robot, or the tracker is for another.
    """
    robot = equipped(policy, robot)
    control = control_of(policy, robot)
    require_same_clock(control_step(robot, control), reference.dt)
    environment = environment_of(policy, control)
    _warn_about_other_motion(policy, reference)
    given = reference
    reference = facing_ahead(reference) if isinstance(environment, PaperConfig) else reference
    clip = driven_clip(robot, reference, control, sees_ahead(policy), progress)
    _warn_about_other_path(policy, reference, clip)
    starts, labels = starts_of(robot, clip, config)
    horizon = clip.horizon(starts.step, config.seconds)
    scorer = RolloutScorer(robot, reference, config)
    meter = RewardMeter(robot, reference, clip, environment)
    fall = Fall.of(robot)
    rows: list[dict[str, object]] = []
    summaries: dict[str, dict[str, float]] = {}
    qpos = np.zeros((0, robot.model.nq))
    for name, driver in drivers(policy, reference, robot, config.seed).items():
        tick = partial(progress, _who(policy).get("tracker", name) if name == TRAINED else name)
        whole = fall.relative and name == TRAINED
        done = roll_out(
            robot, clip, driver, starts, horizon, config.threads, fall, meter, tick, whole
        )
        evaluated = [scorer.row(name, label, done, i) for i, label in enumerate(labels)]
        rows += evaluated
        summaries[name] = summarise(evaluated)
        if name == TRAINED:
            qpos = _recorded_rollout(done, starts)
    own = summaries.pop(TRAINED)
    variants = {name: summaries.pop(name) for name in VARIANTS if name in summaries}
    reward = reward_report(robot, reference, environment, own, float(horizon.mean()))
    seconds = float(horizon.mean()) * clip.dt
    updates = policy.updates if isinstance(policy, Policy) else None
    verdict = verdict_on(own, summaries, seconds, updates)
    shown: dict[str, object] = dict(own)
    baselines: dict[str, object] = dict(summaries)
    if verdict.kind == "too_short":
        shown = without_short_figures(own)
        baselines = {name: without_short_figures(found) for name, found in summaries.items()}
    if reference is not given:
        qpos = FloorMove.onto(reference.qpos[:1], given.qpos[:1]).qpos(qpos)
    facts: dict[str, object] = {"variants": variants, "baselines": baselines, "reward": reward}
    facts |= {**_who(policy), "reference_sha256": poses_sha256(given)}
    if config.passport:
        facts |= passport_facts(passport(policy, reference, robot, config, progress))
    return Evaluation({**shown, **facts, "verdict": verdict.as_facts()}, rows, qpos)


def _who(policy: Evaluated) -> dict[str, str]:
    """Return the name of a tracker, or the digest of a policy's networks."""
    if isinstance(policy, Policy):
        return {"networks_sha256": networks_sha256(policy)}
    return {"tracker": policy.description.name}


def environment_of(policy: Evaluated, control: ControlConfig) -> TrackConfig | PaperConfig:
    """Return the environment of the policy's own reward, without curiosity.

    Raises:
        BadPolicy: it was trained to send torques in mode `track`.
    """
    if not isinstance(policy, Policy):
        return TrackConfig(control=control)
    held = policy.facts.get("environment")
    paper = mode_of(policy) == "paper"
    if control.law == "torque" and not paper:
        raise BadPolicy("the policy has law torque of mode paper in mode track: train it again")
    if not isinstance(held, Mapping):
        return PaperConfig() if paper else TrackConfig(control=control)
    kind: type[PaperConfig | TrackConfig] = PaperConfig if paper else TrackConfig
    found = without_curiosity(fact(policy, "environment", kind))
    return replace(found, control=control) if isinstance(found, TrackConfig) else found


def reward_report(
    robot: Robot,
    reference: ReferenceMotion,
    environment: TrackConfig | PaperConfig,
    own: Mapping[str, float],
    steps: float,
) -> dict[str, object]:
    """Return the mean of every reward term, and the rewards of bodies that do not dance.

    `flagged` is true if a statue carried along would earn over 90 % of the policy's return.
    """
    audits = audit_both_readings(robot, reference, environment)
    reading = environment.relative if isinstance(environment, PaperConfig) else "track"
    nothing = RewardAudit(float("nan"), {"statue": float("nan")})  # a reward without a motion
    known = audits.get(reading, nothing)
    statue = known.statue * steps
    terms = {k.removeprefix("reward_"): v for k, v in own.items() if k.startswith("reward_")}
    total = sum(abs(value) for value in terms.values()) or 1.0
    return {
        "of_terms": {name: value / total for name, value in terms.items()},
        "audit": audit_record(audits),
        "perfect_return": known.perfect * steps,
        "statue_return": statue,
        "own_return": own["return_own"],
        "flagged": bool(statue > STATUE_SHARE * own["return_own"]),
    }


def _warn_about_other_motion(policy: Evaluated, reference: ReferenceMotion) -> None:
    """Warn about an evaluation on another motion than the training's."""
    if isinstance(policy, Policy) and is_of_another_motion(policy, reference):
        log.warning(
            "the policy was trained on another reference motion than the one it is evaluated on"
        )


def _warn_about_other_path(policy: Evaluated, reference: ReferenceMotion, clip: Clip) -> None:
    """Warn about feedback that keeps to another path than the training's along its own motion."""
    if not isinstance(policy, Policy) or is_of_another_motion(policy, reference):
        return
    if is_of_another_path(policy, clip.outline):
        log.warning("%s; here it will dance worse", OTHER_PATH)


def _recorded_rollout(rollouts: Rollouts, starts: Starts) -> np.ndarray:
    """Return the rollout from the clip's first step, its start first, including a fall."""
    steps = min(int(rollouts.length[0]) + 1, len(rollouts.qpos))
    return np.concatenate([starts.qpos[:1], rollouts.qpos[:steps, 0]])
