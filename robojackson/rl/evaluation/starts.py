"""Starts of the rollouts of an evaluation, and means over them."""

import numpy as np

from robojackson.rl.config.train_config import EvaluateConfig, ResetConfig
from robojackson.rl.evaluation.rollouts import Starts
from robojackson.rl.modes.reset_states import default_standing_pose, noisy, standing_pose_at
from robojackson.rl.sim.reference_clip import Clip
from robojackson.robot.model import Robot

MEANT = ("limb_", "excess_", "usage_", "reward_", "return_", "error_")
"""Prefixes of further columns that are averaged over the rollouts."""
LOST = {
    "lost_sites": "off_sites",
    "lost_ends": "off_ends",
    "lost_kneels": "kneels",
    "lost_floor": "on_floor",
}
"""Counts of the rollouts that broke a strict rule without a fall, and the column that says so; one
that broke several stands under each."""
STAND = -1
"""`phase` of the row that starts in the default stand."""


def starts_of(
    robot: Robot, clip: Clip, config: EvaluateConfig
) -> tuple[Starts, list[tuple[int, int]]]:
    """Return evenly spread phases with noisy resets, then the default stand at the first step.

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
    qpos[-1], qvel[-1] = standing_pose_at(default_standing_pose(robot), at.qpos[-1, :7]), 0.0
    return Starts(step, qpos, qvel), labels


def summarise(rows: list[dict[str, object]]) -> dict[str, float]:
    """Return means over rollouts; limb gains only over those in which the limb had to move."""
    keys = ("survived_s", "success", "strict_success", "skill", "site_error_m", "clip_fraction",
            "velocity_score", "drift_m", "heading_error_deg", "travel_ratio", "mpjpe_l_m",
            "mpjpe_g_m", "mpjpe_l_alive_m", "mpjpe_g_alive_m", "acceleration_ratio")  # fmt: skip
    out = {key: _mean(rows, key) for key in keys}
    limbs = [key for key in rows[0] if key.startswith(MEANT)]
    out |= {key: _mean(rows, key) for key in limbs}
    out["limb_gain"] = _nanmean([out[key] for key in limbs if key.startswith("limb_gain_")])
    out["rollouts"] = float(len(rows))
    out["whole_rollouts"] = float(sum(np.isfinite([float(row["mpjpe_l_m"]) for row in rows])))  # type: ignore[arg-type]
    fallen = [bool(row["fell"]) for row in rows]
    out["lost_fell"] = float(sum(fallen))
    for loss, column in LOST.items():
        out[loss] = float(sum(bool(r[column]) and not f for r, f in zip(rows, fallen, strict=True)))
    return out


def _mean(rows: list[dict[str, object]], key: str) -> float:
    return _nanmean([float(row[key]) for row in rows])  # type: ignore[arg-type]


def _nanmean(values: list[float]) -> float:
    finite = [value for value in values if np.isfinite(value)]
    return float(np.mean(finite)) if finite else float("nan")
