"""Strict success: further conditions on every step of a rollout without a fall.

The rule is part of the robot's description (`robot.description.StrictRule`). World frame, metres.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.retarget.solver.collision import Detector
from robojackson.rl.config.train_config import EvaluateConfig
from robojackson.rl.evaluation.rollouts import Rollouts
from robojackson.robot.model import Robot
from robojackson.robot.names import FEET, HANDS

KNEES = ("left_knee", "right_knee")
FLOOR_M = 0.005
"""Height below which a body counts as on the floor."""
AROUND_S = 0.1
"""Tolerance of a contact before or after the reference's, seconds."""


@dataclass(frozen=True)
class StrictFindings:
    """Violations of strict success in a rollout.

    Attributes:
        sites: The mean site error was too large at some step.
        ends: A foot or a hand was too far from the reference's height.
        kneels: A knee was on the floor where the reference's is not.
        floor: Another body was on the floor where the reference's is not.
        worst_end_m: Largest difference in height of feet and hands, m.
    """

    sites: bool
    ends: bool
    kneels: bool
    floor: bool
    worst_end_m: float

    @property
    def any(self) -> bool:
        """Return whether strict success is violated."""
        return self.sites or self.ends or self.kneels or self.floor


class StrictEvaluator:
    """Applies a robot's rule to its rollouts on one reference motion."""

    def __init__(self, robot: Robot, reference: ReferenceMotion, config: EvaluateConfig) -> None:
        rule, names = robot.description.strict, robot.keypoint_names
        self._sites = config.strict_error or rule.sites
        self._knee_height = config.kneel_height or rule.knees
        self._end_height = rule.ends
        self._knees = [names.index(name) for name in KNEES]
        self._ends = [names.index(name) for name in (*FEET, *HANDS)]
        self._cyclic = reference.cyclic
        self._detector = Detector(robot, FLOOR_M, feet=False) if rule.floor else None
        self._count = robot.model.nbody
        self._held: Bool[np.ndarray, "S B"] | None = None
        if self._detector is not None:
            held = self._on_floor(np.asarray(reference.qpos, float))
            self._held = _widened(held, round(AROUND_S / reference.dt), reference.cyclic)

    def findings(
        self, rollouts: Rollouts, i: int, span: slice, start: int, error: Float[np.ndarray, " T"]
    ) -> StrictFindings:
        """Return the violations of one rollout up to its end or its fall.

        Args:
            start: Step of the clip at which it began.
            error: Mean site error at every step, m.
        """
        points, target = rollouts.points[span, i, :, 2], rollouts.target[span, i, :, 2]
        low = self._knee_height
        knees, required = points[:, self._knees], target[:, self._knees]
        off = np.abs(points - target)[:, self._ends].max()
        return StrictFindings(
            sites=float(error.max()) > self._sites,
            ends=self._end_height is not None and float(off) > self._end_height,
            kneels=low is not None and bool(((knees < low) & (required >= low)).any()),
            floor=self._touches(rollouts.qpos[span, i], start),
            worst_end_m=float(off),
        )

    def _touches(self, qpos: Float[np.ndarray, "T nq"], start: int) -> bool:
        """Return whether a body is on the floor where the reference's is not."""
        if self._held is None:
            return False
        step = start + 1 + np.arange(len(qpos))
        last = len(self._held)
        step = step % last if self._cyclic else np.minimum(step, last - 1)
        return bool((self._on_floor(qpos) & ~self._held[step]).any())

    def _on_floor(self, qpos: Float[np.ndarray, "T nq"]) -> Bool[np.ndarray, "T B"]:
        """Return the bodies other than the feet's that are on the floor."""
        found = np.zeros((len(qpos), self._count), bool)
        if self._detector is not None:
            touches = self._detector.touches(qpos)
            frame, bodies = touches.frame[touches.floor], touches.bodies[touches.floor]
            found[frame, bodies[:, 0]] = found[frame, bodies[:, 1]] = True
        found[:, 0] = False
        return found


def _widened(
    held: Bool[np.ndarray, "S B"], steps: Int[np.ndarray, ""] | int, cyclic: bool
) -> Bool[np.ndarray, "S B"]:
    """Return the same, true for some steps before and after, too."""
    padded = np.pad(held, ((int(steps), int(steps)), (0, 0)), mode="wrap" if cyclic else "edge")
    shifted = [padded[k : k + len(held)] for k in range(2 * int(steps) + 1)]
    result: np.ndarray = np.any(shifted, axis=0)
    return result
