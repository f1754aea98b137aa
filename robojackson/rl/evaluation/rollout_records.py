"""Convert one rollout to one row of the evaluation table (definitions in
`metrics.rollout_score`)."""

import mujoco
import numpy as np

from robojackson.geometry.rotations import heading, wrapped
from robojackson.metrics.dance_score import heading_score
from robojackson.metrics.joint_position_error import acceleration_ratio, mpjpe
from robojackson.metrics.rollout_score import (
    STILL_M,
    best_frozen_error,
    heading_frame,
    limb_response,
    site_error,
    skill,
)
from robojackson.motion.reference_motion import ReferenceMotion, tempo_beside_clip
from robojackson.rl.config.train_config import EvaluateConfig
from robojackson.rl.evaluation.rollouts import Rollouts
from robojackson.rl.evaluation.strict_success import StrictEvaluator
from robojackson.rl.modes.rewards import EXTREMITIES
from robojackson.robot.model import KEYPOINTS, Robot
from robojackson.robot.names import FEET, PELVIS

LIMB_ENDS = (*FEET, *EXTREMITIES)
SITES = len(KEYPOINTS)
"""Number of keypoints in mean position errors: the toes of some robots come after them."""
LEAST_MOVING_SHARE = 0.05
"""Least share of the frames for a limb's gain."""
LEAST_SPREAD_RAD = 0.02
"""Least spread of a reference's hinge for a usage, radians."""
LEAST_TRAVEL_M = 0.5
"""Least path of a reference for a travel ratio, metres."""


class RolloutScorer:
    """Turns one rollout into one row of the table."""

    def __init__(self, robot: Robot, reference: ReferenceMotion, config: EvaluateConfig) -> None:
        names = robot.keypoint_names
        self._config, self._dt = config, reference.dt
        self._pelvis = names.index(PELVIS)
        self._strict = StrictEvaluator(robot, reference, config)
        self._limbs = {name: names.index(name) for name in LIMB_ENDS}
        self._model, self._joints = robot.model, robot.joint_names
        self._tempo = tempo_beside_clip(reference.scorecard)
        points = heading_frame(reference.keypoints_w, reference.qpos[:, 3:7], self._pelvis)
        self._moves = best_frozen_error(points) > STILL_M

    def row(
        self, policy: str, label: tuple[int, int], rollouts: Rollouts, i: int
    ) -> dict[str, object]:
        """Return figures of one rollout; errors are means up to its end or its fall."""
        length, fell = int(rollouts.length[i]), bool(rollouts.fell[i])
        span = slice(0, max(length, 1))
        here = heading_frame(rollouts.points[span, i], rollouts.qpos[span, i, 3:7], self._pelvis)
        there = heading_frame(
            rollouts.target[span, i], rollouts.target_qpos[span, i, 3:7], self._pelvis
        )
        error = site_error(here, there)
        phase, reset = label
        found = self._strict.findings(rollouts, i, span, max(phase, 0), error)
        strict = not fell and not found.any
        row: dict[str, object] = {
            "policy": policy,
            "phase": phase,
            "reset": reset,
            "survived_s": length * self._dt,
            "clip_fraction": length / int(rollouts.horizon[i]),
            "fell": fell,
            "success": float(not fell),
            "strict_success": float(strict),
            "off_sites": found.sites,
            "off_ends": found.ends,
            "kneels": found.kneels,
            "on_floor": found.floor,
            "end_height_error_m": found.worst_end_m,
            "site_error_m": float(error.mean()),
            "skill": self._skill(float(error.mean()), there, fell),
            "integrator": mujoco.mjtIntegrator(self._model.opt.integrator).name.removeprefix(
                "mjINT_"
            ),
            "tempo": self._tempo,
        }
        row |= {name: float(total[i]) for name, total in self._means(rollouts).items()}
        row["velocity_score"] = self._velocity_score(rollouts, i, span)
        row |= _position_errors(rollouts, i, span)
        row |= self._whereabouts(rollouts, i, span) | self._limb_figures(here, there)
        return row | self._usage(rollouts, i, span)

    def _skill(self, error_m: float, there: np.ndarray, fell: bool) -> float:
        """Return the skill, 0 for a robot that falls; NaN where the reference hardly moves, whether
        the robot falls or not."""
        if not self._moves:
            return float("nan")
        return 0.0 if fell else skill(error_m, best_frozen_error(there))

    def _velocity_score(self, rollouts: Rollouts, i: int, span: slice) -> float:
        """Return the velocity score along the heading, path included; at most 0 for a robot that
        falls."""
        score = heading_score(
            rollouts.points[span, i],
            rollouts.qpos[span, i, 3:7],
            rollouts.target[span, i],
            rollouts.target_qpos[span, i, 3:7],
        )
        if not rollouts.fell[i] or not self._moves:
            return score
        return 0.0 if np.isnan(score) else min(score, 0.0)

    def _means(self, rollouts: Rollouts) -> dict[str, np.ndarray]:
        """Return returns and their terms summed over the rollout, errors as means."""
        steps = np.maximum(np.minimum(rollouts.length + 1, rollouts.horizon), 1)
        return {
            name: total / steps if name.startswith("error_") else total
            for name, total in rollouts.totals.items()
        }

    def _usage(self, rollouts: Rollouts, i: int, span: slice) -> dict[str, float]:
        """Return every hinge's spread over the rollout, as a multiple of the reference's."""
        own = rollouts.qpos[span, i, 7:].std(0)
        target = rollouts.target_qpos[span, i, 7:].std(0)
        moves = target > LEAST_SPREAD_RAD
        ratio = np.where(moves, own / np.where(moves, target, 1.0), np.nan)
        return {f"usage_{name}": float(r) for name, r in zip(self._joints, ratio, strict=True)}

    def _whereabouts(self, rollouts: Rollouts, i: int, span: slice) -> dict[str, float]:
        """Return position and heading, which the pelvis-heading frame does not show."""
        end = span.stop - 1
        went = rollouts.points[[0, end], i, self._pelvis, :2]
        target = rollouts.target[[0, end], i, self._pelvis, :2]
        turn = heading(rollouts.qpos[end, i, 3:7]) - heading(rollouts.target_qpos[end, i, 3:7])
        path = float(np.linalg.norm(target[1] - target[0]))
        forward = float((went[1] - went[0]) @ (target[1] - target[0]))
        return {
            "drift_m": float(np.linalg.norm(went[1] - target[1])),
            "heading_error_deg": float(np.degrees(np.abs(wrapped(turn)))),
            "travel_ratio": forward / path**2 if path > LEAST_TRAVEL_M else float("nan"),
        }

    def _limb_figures(self, here: np.ndarray, there: np.ndarray) -> dict[str, float]:
        figures: dict[str, float] = {}
        config = self._config
        for name, k in self._limbs.items():
            found = limb_response(here[:, k], there[:, k], self._dt, config.fast, config.max_lag)
            moves = found is not None and found.moving_share > LEAST_MOVING_SHARE
            figures[f"limb_gain_{name}"] = found.gain if found and moves else float("nan")
            figures[f"limb_r2_{name}"] = found.r2 if found and moves else float("nan")
            figures[f"limb_lag_{name}"] = found.lag_s if found and moves else float("nan")
            figures[f"excess_speed_{name}"] = found.excess_m_s if found else float("nan")
        return figures


def _position_errors(rollouts: Rollouts, i: int, span: slice) -> dict[str, float]:
    """Return position errors up to the fall, and to the horizon if robots continued after it."""
    figures: dict[str, float] = {}
    whole = slice(0, int(rollouts.horizon[i]))
    for name, part in {"mpjpe_l_alive_m": span, "mpjpe_l_m": whole}.items():
        roots = (rollouts.qpos[part, i, :3], rollouts.target_qpos[part, i, :3])
        points = (rollouts.points[part, i, :SITES], rollouts.target[part, i, :SITES])
        known = part is span or rollouts.whole or not rollouts.fell[i]
        figures[name] = mpjpe(*points, *roots) if known else float("nan")
        in_world = name.replace("_l_", "_g_")
        figures[in_world] = mpjpe(*points) if known else float("nan")
    points = (rollouts.points[span, i], rollouts.target[span, i])
    return figures | {"acceleration_ratio": acceleration_ratio(*points)}
