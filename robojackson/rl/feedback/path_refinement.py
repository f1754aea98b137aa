"""Move a simulated path towards its motion: iterative LQR (Li and Todorov, 2004; Tassa, Erez and
Todorov, 2012).

A path that was found by sampling has the samples' noise in it, and is off the motion. Each step
solves for the targets whose cost is least when distances are those from the motion, and simulates
them with a few step sizes; the path of least cost is the next one. The derivatives span contacts
(`regulator`), so a full step is too large wherever feet land. They cost ten times as much as the
simulations: several steps use those of one path. Metres, radians, seconds.
"""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from robojackson.rl.feedback.nominal_path import Linear, Path, Pull
from robojackson.rl.feedback.regulator import advance, following, linearised, riccati, weights
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.sim.tangent import state_difference

ROUNDS, STEPS, LEAST_GAIN = 3, 4, 0.05
"""Derivatives at most, steps with the same ones at most, and the smallest share of the cost that
one has to save for another to follow."""
SIZES = (1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.08, 0.05, 0.02)
"""Step sizes that are simulated, shares of the solution."""
DEFECTS = (0.0, 1.0)
"""Shares of the mean defect of disturbed states that a solution corrects: both are simulated."""
LEAD_COST = 0.3
"""Share of the regulator's cost of an offset, for targets that are off the motion's."""
LARGEST_MOVE, LARGEST_LEAD = 2.0, 5.0
"""Largest offsets of a target from the path's and from the motion's, full actions."""


def refinements(
    sim: Simulation,
    path: Path,
    linear: Linear,
    motion: Path,
    action: Float[np.ndarray, " nu"],
    most_rounds: int | None = None,
) -> Iterator[tuple[Path, Linear]]:
    """Yield paths nearer and nearer to a motion, with the system along each.

    Args:
        sim: One robot under the control law, without disturbances.
        path: What a robot did from the motion's first state to its last.
        linear: The system along it.
        motion: The motion as a path.
        action: Radians that a full action moves each target.
        most_rounds: Paths at most; `ROUNDS` when None.
    """
    for _ in range(ROUNDS if most_rounds is None else most_rounds):
        cost = before = _cost(path, motion, action)
        for _ in range(STEPS):
            lower, nearer = _step(sim, path, linear, motion, action)
            enough = lower < (1 - LEAST_GAIN) * cost
            if lower < cost:
                cost, path = lower, nearer
            if not enough:
                break
        if not cost < (1 - LEAST_GAIN) * before:
            return
        linear = linearised(sim, path, following(path))
        yield path, linear


def _step(
    sim: Simulation, path: Path, linear: Linear, motion: Path, action: Float[np.ndarray, " nu"]
) -> tuple[float, Path]:
    """Return the simulated path of least cost, and its cost."""
    pull = _pull(path, motion, action)
    solved = []
    for share in DEFECTS:
        system = Linear(linear.by_state, linear.by_target, share * linear.defect)
        solved.append(riccati(system, action, cyclic=False, pull=pull))
    gain = solved[0].gain  # the same for each
    offsets = np.stack([one.offset for one in solved])
    which, size = np.repeat(range(len(DEFECTS)), len(SIZES)), np.tile(SIZES, len(DEFECTS))[:, None]
    qpos, qvel = (np.repeat(part[:1], len(size), 0) for part in (path.qpos, path.qvel))
    cost, states, targets = np.zeros(len(size)), [(qpos, qvel)], list[np.ndarray]()
    for t in range(len(path) - 1):
        apart = state_difference(qpos, qvel, path.qpos[t], path.qvel[t])
        moved = size * offsets[which, t] + apart @ gain[t].T
        aim = path.targets[t] - np.clip(moved, -LARGEST_MOVE * action, LARGEST_MOVE * action)
        lead = np.clip(aim - motion.targets[t], -LARGEST_LEAD * action, LARGEST_LEAD * action)
        targets.append(motion.targets[t] + lead)
        qpos, qvel = advance(sim, qpos, qvel, targets[-1])
        states.append((qpos, qvel))
        cost += _cost_of(
            state_difference(qpos, qvel, motion.qpos[t + 1], motion.qvel[t + 1]), lead, action
        )
    best = int(np.argmin(np.where(np.isfinite(cost), cost, np.inf)))
    return float(cost[best]), Path(
        np.stack([one[best] for one, _ in states]),
        np.stack([other[best] for _, other in states]),
        np.stack([*(aim[best] for aim in targets), path.targets[-1]]),
    )


def _pull(path: Path, motion: Path, action: Float[np.ndarray, " nu"]) -> Pull:
    """Return the slopes of the cost of being off the motion, at the path."""
    off = _off(path, motion)
    state, effort = weights(action, off.shape[1])
    lead = path.targets - motion.targets
    return Pull(off @ state, LEAD_COST * lead @ effort)


def _cost(path: Path, motion: Path, action: Float[np.ndarray, " nu"]) -> float:
    """Return the cost of a path, whose first state is given and whose last targets move nothing."""
    lead = (path.targets - motion.targets)[:-1]
    return float(_cost_of(_off(path, motion)[1:], lead, action).sum())


def _off(path: Path, motion: Path) -> Float[np.ndarray, "T X"]:
    return state_difference(path.qpos, path.qvel, motion.qpos, motion.qvel)


def _cost_of(
    off: Float[np.ndarray, "N X"], lead: Float[np.ndarray, "N nu"], action: Float[np.ndarray, " nu"]
) -> Float[np.ndarray, " N"]:
    """Return the cost of one step of robots, which are off the motion and lead its targets."""
    state, effort = (np.diag(matrix) for matrix in weights(action, off.shape[1]))
    cost: np.ndarray = off**2 @ state + LEAD_COST * lead**2 @ effort
    return cost


def settings() -> list[float]:
    """Return the numbers that decide what is found."""
    return [ROUNDS, STEPS, LEAST_GAIN, *SIZES, *DEFECTS, LEAD_COST, LARGEST_MOVE, LARGEST_LEAD]
