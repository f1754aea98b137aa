"""A time-varying linear-quadratic regulator along a reference motion (TVLQR; Tassa et al., 2014).

The robot with its PD law is one discrete system: state (root position, root orientation, hinges and
their velocities, in MuJoCo's tangent space), input (targets of the motors), one control step. It is
differentiated along the reference with steps as large as the errors that the feedback shall correct
(`STEPS`): differences that span a contact's opening and closing give the average effect, those of
1e-6 the effect at one side of it, and a regulator from the latter falls at the first step. The
Riccati recursion then gives, for every step of the reference, a gain and an offset that corrects
the reference's own errors. Metres, radians, seconds.
"""

import mujoco
import numpy as np
from jaxtyping import Float
from mujoco import rollout

from robojackson.files.processor_cores import cores
from robojackson.rl.feedback.nominal_path import (
    Gains,
    Linear,
    Path,
    Progress,
    Pull,
    Recursion,
    no_progress,
)
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.sim.tangent import state_difference, state_plus

ROOT_STEP_M, TURN_STEP, HINGE_STEP = 0.008, 0.02, 0.04
VELOCITY_STEP, SPIN_STEP, HINGE_SPEED_STEP, TARGET_STEP = 0.2, 0.4, 0.8, 0.1
"""Half-widths of the differences: m, rad, rad, m/s, rad/s, rad/s, rad."""
PLACE, ATTITUDE, HINGE, VELOCITY, HINGE_SPEED = 20.0, 40.0, 4.0, 0.5, 0.02
"""Weights of squared errors in the cost: m-2, rad-2, rad-2, (m/s or rad/s)-2, (rad/s)-2."""
EFFORT = 0.45
"""Weight of a squared offset of the targets, in full actions of the policy."""
LAPS, STILL = 3, 200
"""Backward passes over a motion that repeats; steps of the stand after one that ends."""
HEIGHTS_M = np.linspace(-0.006, 0.002, 9)
"""Largest displacement of the root that gives the soles the reference's pressure, metres."""
ROWS, ROBOTS_A_THREAD = 3200, 16
"""Numbers of states that are simulated at once, and for which another thread pays."""


def settings() -> list[float]:
    """Return the numbers above: other numbers make another regulator."""
    steps = [ROOT_STEP_M, TURN_STEP, HINGE_STEP, VELOCITY_STEP, SPIN_STEP, HINGE_SPEED_STEP]
    weights = [TARGET_STEP, PLACE, ATTITUDE, HINGE, VELOCITY, HINGE_SPEED, EFFORT, LAPS, STILL]
    return [*steps, *weights, *HEIGHTS_M.tolist()]


def regulator(
    sim: Simulation,
    clip: Clip,
    action: Float[np.ndarray, " nu"],
    feet: int,
    progress: Progress = no_progress,
) -> tuple[Gains, Path, Linear]:
    """Return the regulator of a motion, its path and the system along it.

    Args:
        sim: One robot under the control law, without disturbances.
        clip: One motion.
        action: Radians that a full action moves each target.
        feet: Number of keypoints of the feet.
        progress: Called with a name, the steps that are done, and all.
    """
    path = reference_path(sim, clip, clip.steps)
    linear = linearised(sim, path, following(path, clip if clip.cyclic else None), progress)
    found = riccati(linear, action, clip.cyclic)
    places = np.full((clip.steps, feet, 3), np.nan)
    return Gains(found.gain, found.offset, path.qpos, path.qvel, places), path, linear


def reference_path(sim: Simulation, clip: Clip, length: int) -> Path:
    """Return the first steps of a motion, which may go on into its next cycles."""
    steps = np.arange(length)
    now, ahead = clip.at(steps), clip.at(steps + 1)
    targets = sim.reference_angles(ahead)
    qpos = _settled(sim, now.qpos, now.qvel, targets, ahead.qvel[:, 2])
    return Path(qpos, np.array(now.qvel), targets)


def following(
    path: Path, cycle: Clip | None = None
) -> tuple[Float[np.ndarray, "T nq"], Float[np.ndarray, "T nv"]]:
    """Return the state that follows each one of a path; the last is followed by itself, or by the
    first, moved by a cycle.

    Args:
        cycle: The motion that repeats, of whose cycle this is the path.
    """
    qpos, qvel = np.roll(path.qpos, -1, 0), np.roll(path.qvel, -1, 0)
    if cycle is not None:
        ends = cycle.at(np.array([0, len(path)])).qpos
        qpos[-1, :3] += ends[1, :3] - ends[0, :3]
    else:
        qpos[-1], qvel[-1] = path.qpos[-1], path.qvel[-1]
    return qpos, qvel


def advance(
    sim: Simulation,
    qpos: Float[np.ndarray, "B nq"],
    qvel: Float[np.ndarray, "B nv"],
    targets: Float[np.ndarray, "B nu"],
) -> tuple[Float[np.ndarray, "B nq"], Float[np.ndarray, "B nv"]]:
    """Return the states one control step later, under the PD law of a simulation.

    As many threads as cores step the robots; their number does not change the states.
    """
    model, motors, hinge, nq = sim.model, sim.motors, sim.motors.hinge, sim.model.nq
    threads = max(1, min(cores(), len(qpos) // ROBOTS_A_THREAD))
    data = [mujoco.MjData(model) for _ in range(threads)]
    state = np.concatenate([np.zeros((len(qpos), 1)), qpos, qvel], 1)
    with rollout.Rollout(nthread=threads if threads > 1 else 0) as pool:
        for _ in range(sim.control.substeps or 1):
            angles, speeds = state[:, 8 : 1 + nq][:, hinge], state[:, 7 + nq :][:, hinge]
            torque = sim.kp * (targets - angles) - sim.kd * speeds
            control = np.clip(torque, -motors.limit, motors.limit) / motors.gear
            state = np.asarray(pool.rollout(model, data, state, control[:, None])[0])[:, 0]
    return state[:, 1 : 1 + nq], state[:, 1 + nq :]


def _settled(
    sim: Simulation,
    qpos: np.ndarray,
    qvel: np.ndarray,
    targets: np.ndarray,
    rise: Float[np.ndarray, " S"],
) -> Float[np.ndarray, "S nq"]:
    """Return the states at the height from which the root moves vertically like the reference."""
    missed = []
    for height in HEIGHTS_M:
        moved = qpos.copy()
        moved[:, 2] += height
        missed.append(np.abs(advance(sim, moved, qvel, targets)[1][:, 2] - rise))
    result = qpos.copy()
    result[:, 2] += HEIGHTS_M[np.argmin(missed, 0)]
    return result


def linearised(
    sim: Simulation,
    path: Path,
    after: tuple[np.ndarray, np.ndarray],
    progress: Progress = no_progress,
) -> Linear:
    """Differentiate a robot along a path.

    Args:
        sim: One robot under the control law, without disturbances.
        path: Nominal states and targets.
        after: qpos and qvel that shall follow each of them.
        progress: Called with a name, the steps that are done, and all.
    """
    nv, nu = sim.model.nv, sim.model.nu
    width = np.concatenate([
        np.repeat([ROOT_STEP_M, TURN_STEP, HINGE_STEP], [3, 3, nv - 6]),
        np.repeat([VELOCITY_STEP, SPIN_STEP, HINGE_SPEED_STEP, TARGET_STEP], [3, 3, nv - 6, nu]),
    ])  # fmt: skip
    moves = np.concatenate([np.diag(width), -np.diag(width)])
    found = []
    chunk = max(1, ROWS // len(moves))
    for first in range(0, len(path), chunk):
        progress("feedback", first, len(path))
        rows = slice(first, first + chunk)
        begun = state_plus(path.qpos[rows, None], path.qvel[rows, None], moves[:, : 2 * nv])
        aims = path.targets[rows, None] + moves[:, 2 * nv :]
        ended = advance(sim, *(np.concatenate(list(a)) for a in (*begun, aims)))
        shape = (len(aims), len(moves), -1)
        qpos, qvel = (part.reshape(shape) for part in ended)
        found.append(state_difference(qpos, qvel, after[0][rows, None], after[1][rows, None]))
    change = np.concatenate(found)
    half = len(width)
    slope = np.swapaxes((change[:, :half] - change[:, half:]) / (2 * width[:, None]), 1, 2)
    return Linear(slope[:, :, : 2 * nv], slope[:, :, 2 * nv :], change.mean(1))


def riccati(
    linear: Linear,
    action: Float[np.ndarray, " nu"],
    cyclic: bool,
    pull: Pull | None = None,
    effort: float = 1.0,
) -> Recursion:
    """Return the feedback whose cost is least over the rest of the motion.

    Args:
        linear: The system along a path.
        action: Radians that a full action moves each target.
        cyclic: Whether the path is followed by itself.
        pull: Towards what the path is pulled, of a path that is not where it shall be.
        effort: Factor on the weight of offsets of the targets: below 1 the feedback is stiffer.
    """
    steps, size = linear.defect.shape
    cost, of_offsets = weights(action, size)
    of_offsets = effort * of_offsets
    gain, offset = np.zeros((steps, len(action), size)), np.zeros((steps, len(action)))
    values, slopes = np.zeros((steps, size, size)), np.zeros((steps, size))
    value, slope = cost, np.zeros(size)
    pull = pull or Pull(np.zeros((steps, size)), np.zeros((steps, len(action))))
    order = np.tile(np.arange(steps)[::-1], LAPS if cyclic else 1)
    order = order if cyclic else np.concatenate([np.full(STILL, steps - 2), order])
    for t in order:
        a, b, missed = linear.by_state[t], linear.by_target[t], linear.defect[t]
        weighted = of_offsets + b.T @ value @ b
        wanted = b.T @ np.column_stack([value @ a, value @ missed + slope])
        wanted[:, -1] += pull.target[t]
        both = np.linalg.solve(weighted, wanted)
        gain[t], offset[t] = both[:, :-1], both[:, -1]
        slope = (a - b @ gain[t]).T @ (slope + value @ missed)
        slope += pull.state[t] - gain[t].T @ pull.target[t]
        value = cost + a.T @ value @ (a - b @ gain[t])
        value = (value + value.T) / 2
        values[t], slopes[t] = value, slope
    return Recursion(gain, offset, values, slopes)


def weights(
    action: Float[np.ndarray, " nu"], size: int
) -> tuple[Float[np.ndarray, "X X"], Float[np.ndarray, "nu nu"]]:
    """Return the weights of squared errors of the state and of squared offsets of the targets."""
    hinges = size // 2 - 6
    cost = np.concatenate([
        np.repeat([PLACE, ATTITUDE, HINGE], [3, 3, hinges]),
        np.repeat([VELOCITY, HINGE_SPEED], [6, hinges]),
    ])  # fmt: skip
    return np.diag(cost), np.diag(EFFORT / action**2)
