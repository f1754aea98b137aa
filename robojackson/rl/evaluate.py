"""How a policy is judged: many starts on stock physics, beside baselines that do not dance.

24 phases x 3 noisy resets and the default stand, deterministic policy, one horizon each. Success
is the paper's: no fall (torso below 0.7 m or tilted over 60 degrees). Strict success also forbids
kneeling and a mean site error above 0.30 m at any step. Skill is told against the best frozen pose
over 14 sites with hands and head; a fall counts 0.
"""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float
from pydantic import TypeAdapter

from robojackson.errors import BadPolicy
from robojackson.motion.reference import ReferenceMotion, poses_sha256
from robojackson.retarget.robot import Robot
from robojackson.rl.clip import Clip
from robojackson.rl.config import ControlConfig, EvaluateConfig, ResetConfig, TerminationConfig
from robojackson.rl.judge import Judge
from robojackson.rl.observation import observation_size
from robojackson.rl.physics import Motors, require_same_clock, residual_scale
from robojackson.rl.policy import Policy
from robojackson.rl.rollouts import Controller, Rollouts, Starts, roll_out
from robojackson.rl.starts import default_stand, noisy, stand_at

log = logging.getLogger(__name__)

STAND = -1
"""`phase` of the row that starts in the default stand."""


@dataclass(frozen=True)
class Evaluation:
    """The verdict on a policy.

    Attributes:
        summary: Means over the policy's rollouts, and those of the baselines by name.
        rows: One row a rollout, of the policy and of every baseline.
        rollout_qpos: The policy's rollout from the clip's first step (phase 0, reset 0, whether it
            falls or not), for the video; row s is the state at the reference's step s.
    """

    summary: dict[str, object]
    rows: list[dict[str, object]]
    rollout_qpos: Float[np.ndarray, "S nq"]


def evaluate(
    policy: Policy,
    reference: ReferenceMotion,
    robot: Robot,
    config: EvaluateConfig,
    progress: Callable[[str, int, int], None] = lambda name, step, total: None,
) -> Evaluation:
    """Judge a policy and its baselines on one reference motion.

    Raises:
        BadPolicy: the policy's observation does not fit this robot.
    """
    control = control_of(policy, robot)
    require_same_clock(control.substeps * robot.model.opt.timestep, reference.dt)
    clip = Clip(reference)
    _tell_strangers(policy, reference)
    starts, labels = _starts(robot, clip, config)
    horizon = clip.horizon(starts.step, config.seconds)
    judge = Judge(robot, reference, config)
    rows: list[dict[str, object]] = []
    summary: dict[str, object] = {}
    baselines: dict[str, dict[str, float]] = {}
    qpos = np.zeros((0, robot.model.nq))
    for name, controller in _controllers(policy, reference, robot, control, config).items():
        rollouts = roll_out(
            robot,
            clip,
            control,
            controller,
            starts,
            horizon,
            config.threads,
            TerminationConfig(),
            partial(progress, name),
        )
        judged = [judge.row(name, label, rollouts, i) for i, label in enumerate(labels)]
        rows += judged
        if name == "trained":
            summary |= summarise(judged)
            qpos = _shown(rollouts, starts)
        else:
            baselines[name] = summarise(judged)
    return Evaluation(summary | {"baselines": baselines}, rows, qpos)


def control_of(policy: Policy, robot: Robot) -> ControlConfig:
    """The control law that a policy was trained with.

    Raises:
        BadPolicy: the policy was trained for another robot, or its file says no control law.
    """
    trained_for = policy.facts.get("robot", robot.description.name)
    if trained_for != robot.description.name:
        raise BadPolicy(
            f"the policy was trained for robot {trained_for!r}, not for {robot.description.name!r}"
        )
    if "control" not in policy.facts:
        raise BadPolicy("the policy's file says nothing of its control law")
    hinges, motors = robot.model.nq - 7, robot.model.nu
    size = observation_size(hinges, motors, len(robot.keypoint_names))
    if policy.observation_size != size:
        raise BadPolicy(
            f"the policy takes {policy.observation_size} observations and robot "
            f"{robot.description.name!r} gives {size}: it was trained for another robot"
        )
    return TypeAdapter(ControlConfig).validate_python(policy.facts["control"])


def _tell_strangers(policy: Policy, reference: ReferenceMotion) -> None:
    """A policy may be judged on another motion than it learnt, but not without a word."""
    learnt = policy.facts.get("reference_sha256")
    if learnt is not None and learnt != poses_sha256(reference):
        log.warning(
            "the policy was trained on another reference motion than the one it is judged on"
        )


def summarise(rows: list[dict[str, object]]) -> dict[str, float]:
    """Means over rollouts; limb gains only over those in which the limb had to move."""
    keys = ("survived_s", "success", "strict_success", "skill", "site_error_m", "clip_fraction",
            "drift_m", "heading_error_deg", "travel_ratio")  # fmt: skip
    out = {key: _mean(rows, key) for key in keys}
    limbs = [key for key in rows[0] if key.startswith(("limb_gain_", "limb_r2_", "excess_"))]
    out |= {key: _mean(rows, key) for key in limbs}
    out["limb_gain"] = _nanmean([out[key] for key in limbs if key.startswith("limb_gain_")])
    out["rollouts"] = float(len(rows))
    return out


def _controllers(
    policy: Policy,
    reference: ReferenceMotion,
    robot: Robot,
    control: ControlConfig,
    config: EvaluateConfig,
) -> Mapping[str, Controller]:
    """The policy and the baselines: each gives target hinge angles."""
    hinge = Motors.of(robot.model).hinge
    scale = residual_scale(robot, control)
    rng = np.random.default_rng(config.seed)
    mean_pose = reference.qpos[:, 7:].mean(0)

    def moved(following: np.ndarray, action: np.ndarray) -> np.ndarray:
        target = following.copy()
        target[:, hinge] += scale * action
        return target

    def trained(seen: np.ndarray, following: np.ndarray, start: np.ndarray) -> np.ndarray:
        return moved(following, policy.act(seen))

    def statue(seen: np.ndarray, following: np.ndarray, start: np.ndarray) -> np.ndarray:
        return np.asarray(reference.qpos, float)[start % len(reference), 7:]

    def frozen_mean(seen: np.ndarray, following: np.ndarray, start: np.ndarray) -> np.ndarray:
        return np.broadcast_to(mean_pose, following.shape)

    def zero_residual(seen: np.ndarray, following: np.ndarray, start: np.ndarray) -> np.ndarray:
        return following

    def flail(seen: np.ndarray, following: np.ndarray, start: np.ndarray) -> np.ndarray:
        return moved(following, rng.uniform(-1, 1, (len(following), len(hinge))))

    return {
        "trained": trained,
        "statue": statue,
        "mean_pose": frozen_mean,
        "zero_residual": zero_residual,
        "random": flail,
    }


def _starts(
    robot: Robot, clip: Clip, config: EvaluateConfig
) -> tuple[Starts, list[tuple[int, int]]]:
    """Evenly spread phases with noisy resets, then the default stand at the first step.

    A clip that is not cyclic is started in its first quarter, so that most of it is always danced.
    """
    usable = clip.steps if clip.cyclic else max(1, clip.steps // 4)
    phases = np.linspace(0, usable, config.phases, endpoint=False).astype(int)
    labels = [(int(p), r) for p in phases for r in range(config.resets)] + [(STAND, 0)]
    step = np.array([max(phase, 0) for phase, _ in labels])
    at = clip.at(step)
    noise = ResetConfig(
        joint_noise=config.joint_noise,
        joint_speed_noise=config.joint_speed_noise,
        root_speed_noise=config.root_speed_noise,
    )
    qpos, qvel = noisy(at.qpos, at.qvel, noise, np.random.default_rng(config.seed))
    qpos[-1], qvel[-1] = stand_at(default_stand(robot.model), at.qpos[-1, :7]), 0.0
    return Starts(step, qpos, qvel), labels


def _shown(rollouts: Rollouts, starts: Starts) -> np.ndarray:
    """The rollout from the clip's first step, its start first, with its fall if it falls."""
    steps = min(int(rollouts.length[0]) + 1, len(rollouts.qpos))
    return np.concatenate([starts.qpos[:1], rollouts.qpos[:steps, 0]])


def _mean(rows: list[dict[str, object]], key: str) -> float:
    return _nanmean([float(row[key]) for row in rows])  # type: ignore[arg-type]


def _nanmean(values: list[float]) -> float:
    finite = [value for value in values if np.isfinite(value)]
    return float(np.mean(finite)) if finite else float("nan")
