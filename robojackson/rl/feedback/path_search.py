"""Search by sampling for a physically feasible path near a reference motion.

A regulator along a motion that is not exactly feasible (sliding feet, a small error of balance)
falls where the motion needs too much. So the motion is simulated first: many robots follow it under
the regulator with random offsets of their targets, a window of a few control steps at a time; those
of least cost continue (SAMCON: Liu, Yin, van de Panne, Shao and Xu, SIGGRAPH 2010; Liu, Yin and
Guo, 2015). Cost: that of the regulator, whose value function gives the later cost of the state at
the end of the window. Where all robots fall, the found path becomes the nominal one up to shortly
before, and the search continues from there. The position of the feet determines the place of the
motion in the world: a robot that slid aside dances on from there. Metres, radians, seconds.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.rl.feedback.keypoint_rule import KeypointRule
from robojackson.rl.feedback.nominal_path import Path, Progress, Recursion, no_progress
from robojackson.rl.feedback.regulator import advance, weights
from robojackson.rl.feedback.standing_feet import Feet
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.sim.tangent import state_difference

WINDOW, SAMPLES, KEPT, CHILDREN = 8, 320, 32, 8
"""Control steps a window, robots in it, survivors, and the largest number of survivors from one
parent."""
OFFSET_SCALES, OFFSET_SHARES = (0.15, 0.4, 1.0), (0.15, 0.4, 1.0)
"""Random offsets of a window: spread, full actions; share of the motors."""
LARGEST_OFFSET, LARGEST_FEEDBACK = 4.0, 2.0
"""Largest offset, full actions."""
GOES_ON, ALONG = 0.4, 0.4
"""Shares of robots whose offset adds to that before, and whose offset is that of another state."""
ELSEWHERE = np.array([0.03, 0.03, 0.01, 0.06, 0.06, 0.06])
ELSEWHERE_SPEED = 0.15
"""Standard deviations of that other state: root's place and attitude; its velocities."""
OFFSET_COST, PLACE_COST = 0.3, 20.0
"""Share of the regulator's cost of an offset; cost of a squared distance from the place, m-2."""
LOST_RAD = 0.8
RULE_SHARE = 0.8
"""Share of the limits of the strict rule beyond which a robot goes on only if all others do."""


@dataclass
class _Beam:
    """Robots side by side: their states, offsets of the window before, shifts and costs so far."""

    qpos: Float[np.ndarray, "N nq"]
    qvel: Float[np.ndarray, "N nv"]
    offset: Float[np.ndarray, "N nu"]
    shift: Float[np.ndarray, "N 2"]
    cost: Float[np.ndarray, " N"]

    def of(self, rows: Int[np.ndarray, " M"]) -> "_Beam":
        return _Beam(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


@dataclass(frozen=True)
class _Window:
    """Steps of the surviving robots, and the parent of each."""

    parent: Int[np.ndarray, " M"]
    states: list[tuple[np.ndarray, np.ndarray, np.ndarray]]


class PathSearch:
    """Simulations of one motion with sampled offsets.

    Args:
        sim: One robot under the control law, without disturbances.
        action: Radians that a full action moves each target.
        feet: The robot's feet.
        rule: What the keypoints of the robots must keep.
        reference: The motion as a path.
        rng: Draws the offsets.
    """

    def __init__(
        self,
        sim: Simulation,
        action: np.ndarray,
        feet: Feet,
        rule: KeypointRule,
        reference: Path,
        rng: np.random.Generator,
    ) -> None:
        self._sim, self._action, self._feet = sim, action, feet
        self._reference, self._rng, self._rule = reference, rng, rule
        self._points = rule.points(reference.qpos)
        self._places = feet.places(reference.qpos)
        self._breadth = 1

    def run(
        self,
        path: Path,
        law: Recursion,
        begin: int,
        breadth: int = 1,
        progress: Progress = no_progress,
    ) -> tuple[Path, bool]:
        """Return a simulated path from a step of another on, and whether it reaches the end.

        Args:
            path: What is followed.
            law: The regulator along it.
            begin: Step from which it is simulated.
            breadth: Factor on the number of robots, and, by its root, on their offsets.
            progress: Called with a name, the steps that are done, and all.
        """
        self._breadth = breadth
        rows = np.zeros(KEPT, int)
        none = np.zeros((1, len(self._action)))
        first = _Beam(path.qpos[[begin]], path.qvel[[begin]], none, np.zeros((1, 2)), np.zeros(1))
        beam, windows, t = first.of(rows), list[_Window](), begin
        aside = self._feet.apart(path.qpos, self._places)
        beam.shift = self._feet.apart(beam.qpos, self._places[begin])
        upright = True
        while upright and t < len(path) - 1:
            steps = min(WINDOW, len(path) - 1 - t)
            beam, window = self._window(beam, path, aside, law, t, steps)
            windows.append(window)
            t += steps
            progress("sampled path", t, len(path))
            beam.shift = self._feet.apart(beam.qpos, self._places[t])
            tilt = state_difference(beam.qpos[:1], beam.qvel[:1], path.qpos[t], path.qvel[t])
            upright = bool(np.linalg.norm(tilt[0, 3:6]) < LOST_RAD)
        return _traced(first, windows, path.targets[min(t, len(path) - 1)]), upright

    def joined(self, path: Path, found: Path, begin: int, kept: int) -> Path:
        """Return a path with the found one up to a step, followed by the reference."""
        parts = []
        for name in ("qpos", "qvel", "targets"):
            array = getattr(self._reference, name).copy()
            array[:begin] = getattr(path, name)[:begin]
            array[begin:kept] = getattr(found, name)[: kept - begin]
            parts.append(array)
        return Path(*parts)

    def _window(
        self,
        beam: _Beam,
        path: Path,
        aside: Float[np.ndarray, "T 2"],
        law: Recursion,
        t: int,
        steps: int,
    ) -> tuple[_Beam, _Window]:
        rng, action = self._rng, self._action
        more = self._breadth * SAMPLES - KEPT
        parent = np.concatenate([np.arange(KEPT), rng.integers(0, KEPT, more)])
        now = beam.of(parent)
        aim = self._offsets(now, law.gain[t + steps // 2])
        state_cost, effort = (np.diag(matrix) for matrix in weights(action, law.slope.shape[1]))
        states, broken = [], np.zeros(len(parent))
        for k in range(steps):
            offset = now.offset + (aim - now.offset) * min(1.0, (k + 1) / (0.6 * steps))
            apart = _apart(now, path, aside, t + k)
            fed = apart @ law.gain[t + k].T + law.offset[t + k]
            moved = offset - np.clip(fed, -LARGEST_FEEDBACK * action, LARGEST_FEEDBACK * action)
            targets = path.targets[t + k] + moved
            now.qpos, now.qvel = advance(self._sim, now.qpos, now.qvel, targets)
            states.append((now.qpos, now.qvel, targets))
            broken += self._breaks(now.qpos, t + k + 1)
            apart = _apart(now, path, aside, t + k + 1)
            now.cost = now.cost + apart**2 @ state_cost + OFFSET_COST * offset**2 @ effort
        last = t + steps
        ahead = (
            np.einsum("ni,ij,nj->n", apart, law.value[last], apart) + 2 * apart @ law.slope[last]
        )
        away = now.qpos[:, :2] - self._reference.qpos[last, :2]
        score = now.cost + ahead + PLACE_COST * (away**2).sum(1)
        rows = _best(np.where(np.isfinite(score), score, np.inf), parent, broken)
        now.offset = aim
        chosen = [(qpos[rows], qvel[rows], targets[rows]) for qpos, qvel, targets in states]
        return now.of(rows), _Window(parent[rows], chosen)

    def _breaks(self, qpos: Float[np.ndarray, "N nq"], t: int) -> Bool[np.ndarray, " N"]:
        """Return which robots break the rule at a step of the motion."""
        return ~self._rule.keeps(qpos, self._reference.qpos[t], self._points[t])

    def _offsets(self, beam: _Beam, gain: Float[np.ndarray, "nu X"]) -> Float[np.ndarray, "N nu"]:
        """Draw the offsets of a window; the first robots have none."""
        rng, (n, motors) = self._rng, beam.offset.shape
        scale = np.sqrt(self._breadth) * rng.choice(OFFSET_SCALES, (n, 1))
        moved = rng.random((n, motors)) < rng.choice(OFFSET_SHARES, (n, 1))
        offset = scale * self._action * rng.normal(size=(n, motors)) * moved
        along: Bool[np.ndarray, " N"] = np.less(rng.random(n), ALONG)
        state = np.zeros((n, gain.shape[1]))
        state[:, :6] = ELSEWHERE * rng.normal(size=(n, 6))
        half = gain.shape[1] // 2
        state[:, half : half + 6] = ELSEWHERE_SPEED * rng.normal(size=(n, 6))
        offset[along] = (scale * (state @ gain.T))[along]
        goes_on = rng.random(n) < GOES_ON
        offset[goes_on] += beam.offset[goes_on]
        offset[:KEPT] = 0.0
        limit = LARGEST_OFFSET * self._action
        result: np.ndarray = np.clip(offset, -limit, limit)
        return result


def _apart(
    beam: _Beam, path: Path, aside: Float[np.ndarray, "T 2"], t: int
) -> Float[np.ndarray, "N X"]:
    """Return the distances of robots from a path that is moved to where they stand.

    Args:
        aside: How far the path's own feet are from the motion's, along the floor.
    """
    apart = state_difference(beam.qpos, beam.qvel, path.qpos[t], path.qvel[t])
    apart[:, :2] -= beam.shift - aside[t]
    return apart


def _best(
    score: Float[np.ndarray, " N"],
    parent: Int[np.ndarray, " N"],
    broken: Float[np.ndarray, " N"],
) -> Int[np.ndarray, " M"]:
    """Return the surviving robots, few of them from the same parent: those that broke the rule in
    the fewest steps, of these the ones of least score first."""
    found, children = [], np.zeros(len(score), int)
    for row in np.lexsort((score, broken)):
        if children[parent[row]] < CHILDREN:
            children[parent[row]] += 1
            found.append(row)
    return np.array(found[:KEPT])


def _traced(first: _Beam, windows: list[_Window], last: Float[np.ndarray, " nu"]) -> Path:
    """Return the path of the best robot of the last window."""
    row, states = 0, list[tuple[np.ndarray, np.ndarray, np.ndarray]]()
    for window in reversed(windows):
        states[:0] = [(qpos[row], qvel[row], targets[row]) for qpos, qvel, targets in window.states]
        row = int(window.parent[row])
    qpos = np.stack([first.qpos[0], *(state[0] for state in states)])
    qvel = np.stack([first.qvel[0], *(state[1] for state in states)])
    return Path(qpos, qvel, np.stack([*(state[2] for state in states), last]))


def settings() -> list[float]:
    """Return the numbers of the search: other numbers give another path."""
    counts = [WINDOW, SAMPLES, KEPT, CHILDREN, *OFFSET_SCALES, *OFFSET_SHARES, LARGEST_OFFSET]
    costs = [LARGEST_FEEDBACK, GOES_ON, ALONG, *ELSEWHERE.tolist(), ELSEWHERE_SPEED]
    return [*counts, *costs, OFFSET_COST, PLACE_COST, LOST_RAD, RULE_SHARE]
