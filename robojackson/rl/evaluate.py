"""How a policy is judged: many starts on stock physics, beside baselines that do not dance.

24 phases x 3 noisy resets and the default stand, deterministic policy, one horizon each. Success
is the paper's: no fall (torso below 0.7 m or tilted over 60 degrees). Strict success also forbids
kneeling and a mean site error above 0.30 m at any step. Skill is told against the best frozen pose
over 14 sites with hands and head; a fall counts 0.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float
from pydantic import TypeAdapter

from robojackson.errors import BadPolicy
from robojackson.metrics.rollout import (
    best_frozen_error,
    heading_frame,
    limb_response,
    site_error,
    skill,
)
from robojackson.motion.reference import ReferenceMotion
from robojackson.retarget.robot import Robot
from robojackson.rl.clip import Clip
from robojackson.rl.config import ControlConfig, EvaluateConfig, ResetConfig, TerminationConfig
from robojackson.rl.observation import observation_size
from robojackson.rl.physics import residual_scale
from robojackson.rl.policy import Policy
from robojackson.rl.rollouts import Controller, Rollouts, Starts, roll_out
from robojackson.rl.starts import default_stand, noisy, stand_at
from robojackson.rl.tracking import EXTREMITIES, FEET, PELVIS

KNEES = ("left_knee", "right_knee")
LIMB_ENDS = (*FEET, *EXTREMITIES)
STAND = -1
"""`phase` of the row that starts in the default stand."""


@dataclass(frozen=True)
class Evaluation:
    """The verdict on a policy.

    Attributes:
        summary: Means over the policy's rollouts, and those of the baselines by name.
        rows: One row a rollout, of the policy and of every baseline.
        rollout_qpos: The policy's rollout from the clip's first step, for the video.
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
    clip = Clip(reference)
    starts, labels = _starts(robot, clip, config)
    horizon = _horizons(clip, starts, config)
    judge = _Judge(robot, reference, config)
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
            qpos = _shown(rollouts, labels)
        else:
            baselines[name] = summarise(judged)
    return Evaluation(summary | {"baselines": baselines}, rows, qpos)


def control_of(policy: Policy, robot: Robot) -> ControlConfig:
    """The control law that a policy was trained with.

    Raises:
        BadPolicy: the policy's observation does not fit this robot.
    """
    hinges, motors = robot.model.nq - 7, robot.model.nu
    size = observation_size(hinges, motors, len(robot.keypoint_names))
    if policy.observation_size != size:
        raise BadPolicy(
            f"the policy takes {policy.observation_size} observations and robot "
            f"{robot.description.name!r} gives {size}: it was trained for "
            f"{policy.facts.get('robot', 'another robot')!r}"
        )
    return TypeAdapter(ControlConfig).validate_python(policy.facts["control"])


def summarise(rows: list[dict[str, object]]) -> dict[str, float]:
    """Means over rollouts; limb gains only over those in which the limb had to move."""
    keys = ("survived_s", "success", "strict_success", "skill", "site_error_m", "clip_fraction")
    out = {key: _mean(rows, key) for key in keys}
    limbs = [key for key in rows[0] if key.startswith(("limb_gain_", "limb_r2_", "excess_"))]
    out |= {key: _mean(rows, key) for key in limbs}
    out["limb_gain"] = _nanmean([out[key] for key in limbs if key.startswith("limb_gain_")])
    out["rollouts"] = float(len(rows))
    return out


class _Judge:
    """Turns one rollout into one row of the table."""

    def __init__(self, robot: Robot, reference: ReferenceMotion, config: EvaluateConfig) -> None:
        names = robot.keypoint_names
        self._config, self._dt = config, reference.dt
        self._pelvis = names.index(PELVIS)
        self._knees = [names.index(name) for name in KNEES]
        self._limbs = {name: names.index(name) for name in LIMB_ENDS}
        self._cyclic, self._steps = reference.cyclic, len(reference)
        wanted = heading_frame(reference.keypoints_w, reference.qpos[:, 3:7], self._pelvis)
        self.frozen_error = best_frozen_error(wanted)

    def row(
        self, policy: str, label: tuple[int, int], rollouts: Rollouts, i: int
    ) -> dict[str, object]:
        length, fell = int(rollouts.length[i]), bool(rollouts.fell[i])
        span = slice(0, max(length, 1))
        here = heading_frame(rollouts.points[span, i], rollouts.qpos[span, i, 3:7], self._pelvis)
        there = heading_frame(rollouts.wanted[span, i], rollouts.wanted_root[span, i], self._pelvis)
        error = site_error(here, there)
        knees = rollouts.points[span, i][:, self._knees, 2]
        wanted_knees = rollouts.wanted[span, i][:, self._knees, 2]
        low = self._config.kneel_height
        kneels = bool(((knees < low) & (wanted_knees >= low)).any())
        strict = not fell and not kneels and float(error.max()) <= self._config.strict_error
        phase, reset = label
        row: dict[str, object] = {
            "policy": policy,
            "phase": phase,
            "reset": reset,
            "survived_s": length * self._dt,
            "clip_fraction": length / self._steps,
            "fell": fell,
            "success": float(not fell),
            "strict_success": float(strict),
            "kneels": kneels,
            "site_error_m": float(error.mean()),
            "skill": 0.0 if fell else skill(float(error.mean()), self.frozen_error),
            "integrator": "RK4",
            "tempo": 1.0,
        }
        return row | self._limb_figures(here, there)

    def _limb_figures(self, here: np.ndarray, there: np.ndarray) -> dict[str, float]:
        figures: dict[str, float] = {}
        config = self._config
        for name, k in self._limbs.items():
            found = limb_response(here[:, k], there[:, k], self._dt, config.fast, config.max_lag)
            moves = found is not None and found.moving_share > 0.05
            figures[f"limb_gain_{name}"] = found.gain if found and moves else float("nan")
            figures[f"limb_r2_{name}"] = found.r2 if found and moves else float("nan")
            figures[f"excess_speed_{name}"] = found.excess_m_s if found else float("nan")
        return figures


def _controllers(
    policy: Policy,
    reference: ReferenceMotion,
    robot: Robot,
    control: ControlConfig,
    config: EvaluateConfig,
) -> Mapping[str, Controller]:
    """The policy and the baselines: each gives target hinge angles."""
    order = np.argsort(robot.model.jnt_qposadr[robot.model.actuator_trnid[:, 0]])
    scale = residual_scale(robot, control)
    rng = np.random.default_rng(config.seed)
    mean_pose = reference.qpos[:, 7:].mean(0)

    def trained(seen: np.ndarray, following: np.ndarray, start: np.ndarray) -> np.ndarray:
        return following + (scale * policy.act(seen))[:, order]

    def statue(seen: np.ndarray, following: np.ndarray, start: np.ndarray) -> np.ndarray:
        return np.asarray(reference.qpos, float)[start % len(reference), 7:]

    def frozen_mean(seen: np.ndarray, following: np.ndarray, start: np.ndarray) -> np.ndarray:
        return np.broadcast_to(mean_pose, following.shape)

    def zero_residual(seen: np.ndarray, following: np.ndarray, start: np.ndarray) -> np.ndarray:
        return following

    def flail(seen: np.ndarray, following: np.ndarray, start: np.ndarray) -> np.ndarray:
        return following + scale[order] * rng.uniform(-1, 1, following.shape)

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
    """Evenly spread phases with noisy resets, then the default stand at the first step."""
    usable = clip.steps if clip.cyclic else max(1, clip.steps * 3 // 4)
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


def _horizons(clip: Clip, starts: Starts, config: EvaluateConfig) -> np.ndarray:
    """Steps of each rollout: the given time when cyclic, else from the start to the clip's end."""
    if clip.cyclic:
        return np.full(len(starts.step), clip.horizon(config.seconds))
    return clip.steps - 1 - starts.step


def _shown(rollouts: Rollouts, labels: list[tuple[int, int]]) -> np.ndarray:
    """The longest rollout among those that start at the clip's first step, with its fall."""
    first = [i for i, (phase, _) in enumerate(labels) if phase == 0]
    best = max(first, key=lambda i: int(rollouts.length[i]))
    return rollouts.qpos[: int(rollouts.length[best]) + 1, best]


def _mean(rows: list[dict[str, object]], key: str) -> float:
    return _nanmean([float(row[key]) for row in rows])  # type: ignore[arg-type]


def _nanmean(values: list[float]) -> float:
    finite = [value for value in values if np.isfinite(value)]
    return float(np.mean(finite)) if finite else float("nan")
