"""How well a regulator alone holds robots on a motion, from noisy starts and by the evaluation's
rules. Metres, radians, seconds."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from robojackson.rl.feedback.feedback_law import Feedback
from robojackson.rl.feedback.keypoint_rule import KeypointRule
from robojackson.rl.feedback.nominal_path import Gains, Path
from robojackson.rl.feedback.path_search import LOST_RAD
from robojackson.rl.feedback.regulator import advance
from robojackson.rl.feedback.standing_feet import Feet
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.sim.tangent import state_difference, state_plus
from robojackson.robot.model import Robot

STARTS, RESETS, HELD_S = 24, 2, 10.0
"""Where the regulator alone is tried, how often from each of them, and for how long on a motion
that repeats."""
NOISE = (0.02, 0.1, 0.02)
"""Standard deviations of these starts from the motion: hinges, rad; their speeds, rad/s; the root's
velocities, m/s and rad/s. Without noise a path that only exact states follow seems as good as one
that bears errors."""
AS_MANY, POOR = 0.042, 0.5
"""Share of the starts (two of them) that two regulators may differ by for no other reason than the
noise of the starts; share below which a regulator holds little."""
LARGEST_MOVE = 6.0
"""Full actions that the feedback moves a target at most: a path is up to four off the motion."""


class Held(NamedTuple):
    """How a regulator alone holds robots; earlier fields decide.

    Attributes:
        strictly: Share of the starts that come to the end by the robot's strict rule for the
            keypoints (`StrictRule`).
        to_end: Share of the starts that come to the end.
        of_the_time: Share of the time in which robots are upright.
    """

    strictly: float
    to_end: float
    of_the_time: float

    def beats(self, other: "Held") -> bool:
        """Return whether it holds more. Where neither holds half of the starts strictly and they
        differ by two at most, those that come to the end decide."""
        if max(self.strictly, other.strictly) < POOR:
            for mine, theirs in zip(self[:2], other[:2], strict=True):
                if abs(mine - theirs) > AS_MANY:
                    return mine > theirs
        return self > other


class Trial:
    """The same noisy starts for every regulator of a motion.

    Args:
        sim: One robot under the control law, without disturbances.
        clip: One motion.
        action: Radians that a full action moves each target.
        path: The motion, whose targets a regulator moves.
    """

    def __init__(
        self,
        robot: Robot,
        sim: Simulation,
        clip: Clip,
        action: Float[np.ndarray, " nu"],
        path: Path,
    ) -> None:
        self._sim, self._clip, self._path = sim, clip, path
        self._most, self._feet = LARGEST_MOVE * action, Feet(robot)
        self._rule = KeypointRule(robot)
        last = clip.steps if clip.cyclic else max(1, clip.steps // 4)
        steps = np.linspace(0, last, STARTS, endpoint=False).astype(int)
        self._start = np.repeat(steps, RESETS)
        ends = np.full(len(self._start), round(HELD_S / clip.dt))
        self._ends = ends if clip.cyclic else clip.steps - 1 - self._start

    def held(self, gains: Gains) -> Held:
        """Simulate all starts under a regulator."""
        sim, clip, start, ends = self._sim, self._clip, self._start, self._ends
        at, law = clip.at(start), Feedback(gains, self._most, self._feet)
        qpos, qvel = state_plus(at.qpos, at.qvel, _disturbed(len(start), sim.model.nv))
        upright, strict = np.ones(len(start), bool), np.ones(len(start), bool)
        time = np.zeros(len(start))
        for k in range(int(ends.max())):
            (now,) = np.nonzero(upright & (k < ends))
            if not len(now):
                break
            row, there = (start[now] + k) % clip.steps, clip.at(start[now] + k)
            step = law.at(row, there.qpos[:, :3] - clip.at(row).qpos[:, :3])
            targets = self._path.targets[row] + step.targets(qpos[now], qvel[now])
            qpos[now], qvel[now] = advance(sim, qpos[now], qvel[now], targets)
            tilt = state_difference(qpos[now], qvel[now], there.qpos, qvel[now])[:, 3:6]
            upright[now] = np.linalg.norm(tilt, axis=1) < LOST_RAD
            then = clip.at(start[now] + k + 1)
            strict[now] &= self._rule.keeps(qpos[now], then.qpos, then.points)
            time[now] += upright[now]
        share = float((upright & strict).mean())
        return Held(share, float(upright.mean()), float((time / ends).mean()))


def _disturbed(robots: int, nv: int) -> Float[np.ndarray, "N X"]:
    """Return the noise of the starts, the same in every trial."""
    hinges, speeds, root = NOISE
    spread = np.repeat([0.0, hinges, root, speeds], [6, nv - 6, 6, nv - 6])
    return spread * np.random.default_rng(0).normal(size=(robots, 2 * nv))


def settings() -> list[float]:
    """Return the numbers that decide which regulator is taken."""
    return [STARTS, RESETS, HELD_S, *NOISE, LARGEST_MOVE]
