"""The peer of the retargeting benchmark: inverse kinematics of every frame by mink.

Same robot, same keypoint targets and weights as ours; position tasks on the sites, joint limits, a
true limit of speed from frame to frame. `lock` gives it the contacts, too, as our solver has them:
a foot in contact is at the height of the floor and stays where it was first planted. Without
`lock` it follows the keypoints alone and may slip, float and sink.
`filtered` is the same motion through a zero-phase low-pass of 6 Hz. mink is a bench dependency:
`.venv/bin/pip install -e '.[bench]'`.
"""

import numpy as np
from jaxtyping import Float
from scipy.signal import butter, sosfiltfilt

from robojackson.errors import MissingDependency
from robojackson.motion.smpl_sequence import AIR, PLANTED
from robojackson.retarget.solver.clip_problem import Problem, Weights
from robojackson.retarget.solver.initial_poses import rest_start
from robojackson.retarget.solver.levenberg_marquardt import clip_to_limits
from robojackson.retarget.targets.keypoint_targets import Targets
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import continuous

_COST, _FOOT_COST = 10.0, 60.0
_FIRST, _ITERATIONS, _ARRIVED = 50, 10, 1e-3
_CUTOFF_HZ = 6.0


def per_frame(robot: Robot, aims: Targets, lock: bool) -> Float[np.ndarray, "S nq"]:
    """Return qpos of every frame, each solved from the one before.

    Args:
        lock: Whether feet in contact are held; for robots with one ball a foot.

    Raises:
        MissingDependency: mink is not installed.
    """
    try:
        import mink
    except ImportError as cause:
        raise MissingDependency("mink is missing: .venv/bin/pip install -e '.[bench]'") from cause
    body = mink.Configuration(robot.model)
    body.update(rest_start(Problem.of(robot, aims, Weights()))[0])
    weighted = np.flatnonzero(robot.keypoint_weights).tolist()
    tasks = [_task(mink, robot, column) for column in weighted]
    posture = mink.PostureTask(robot.model, cost=1e-2)
    posture.set_target(robot.standing)
    limit = mink.ConfigurationLimit(robot.model, gain=1.0)
    held = dict.fromkeys(robot.contact_keypoints.tolist() if lock else [])
    out = np.zeros((len(aims), robot.model.nq))
    for step in range(len(aims)):
        for task, column in zip(tasks, weighted, strict=True):
            at = _held_at(robot, aims, step, column, held)
            _aim(mink, task, robot, aims.keypoints_w[step, column] if at is None else at, column)
            if at is not None:
                task.set_position_cost(_FOOT_COST)
        if step:
            _bound(limit, robot, out[step - 1], aims.dt)
        before = np.inf
        for _ in range(_ITERATIONS if step else _FIRST):
            velocity = mink.solve_ik(
                body, [*tasks, posture], aims.dt, "daqp", damping=1e-3, limits=[limit]
            )
            body.integrate_inplace(velocity, aims.dt)
            error = float(np.linalg.norm([task.compute_error(body) for task in tasks]))
            if step and before - error < _ARRIVED:
                break
            before = error
        out[step] = body.q
    return continuous(clip_to_limits(robot, out))


def filtered(robot: Robot, qpos: Float[np.ndarray, "S nq"], dt: float) -> np.ndarray:
    """Return the motion through a zero-phase Butterworth low-pass of order 4 at 6 Hz."""
    sections = butter(4, _CUTOFF_HZ, fs=1.0 / dt, output="sos")
    smooth = sosfiltfilt(sections, qpos, axis=0, padlen=min(len(qpos) - 1, 60))
    smooth[:, 3:7] /= np.linalg.norm(smooth[:, 3:7], axis=1, keepdims=True)
    return clip_to_limits(robot, smooth)


def _task(mink, robot: Robot, column: int):  # type: ignore[no-untyped-def]
    cost = _COST * np.sqrt(robot.keypoint_weights[column])
    name = robot.model.site(robot.keypoint_sites[column]).name
    return mink.FrameTask(name, "site", position_cost=cost, orientation_cost=0.0, lm_damping=0.1)


def _aim(mink, task, robot: Robot, at: np.ndarray, column: int) -> None:  # type: ignore[no-untyped-def]
    task.set_position_cost(_COST * np.sqrt(robot.keypoint_weights[column]))
    task.set_target(mink.SE3.from_translation(at))


def _held_at(
    robot: Robot, aims: Targets, step: int, column: int, held: dict[int, np.ndarray | None]
) -> np.ndarray | None:
    """Return where a foot in contact must be, else None; `held` remembers where it was planted."""
    if column not in held:
        return None
    ball = robot.contact_keypoints.tolist().index(column)
    state, at = aims.contact[step, ball], aims.keypoints_w[step, column].copy()
    if state == AIR:
        held[column] = None
        return None
    at[2] = robot.contact_radii[ball]
    if state != PLANTED:
        held[column] = None
        result: np.ndarray = at
        return result
    if held[column] is None:
        held[column] = at
    return held[column]


def _bound(limit, robot: Robot, before: np.ndarray, dt: float) -> None:  # type: ignore[no-untyped-def]
    """Keep hinges within their limits and within the reach of their speed limit."""
    reach = robot.actuation.motion_speed * dt
    limit.lower[7:] = np.maximum(robot.lower, before[7:] - reach)
    limit.upper[7:] = np.minimum(robot.upper, before[7:] + reach)
