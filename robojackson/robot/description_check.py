"""Everything that is wrong with a robot description, a line each, in one go.

`load_robot` stops at the first error; here every name is looked up by itself, and what a robot can
be loaded with although it is hardly meant is reported, too.
"""

from collections.abc import Callable, Iterator, Sequence
from fnmatch import fnmatchcase
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.errors import RoboJacksonError
from robojackson.robot.actuation import per_hinge
from robojackson.robot.checks import check_contact, check_floor, joint_faults, unit_faults
from robojackson.robot.description import KEYPOINTS, TOES, RobotDescription
from robojackson.robot.fixed_joints import fix_joints
from robojackson.robot.mjcf import mjcf_path, read_spec
from robojackson.robot.model import Robot, load_robot
from robojackson.robot.model_files import FAULTS, first_line
from robojackson.robot.names import known, matching, where

SWAPPED_M = 0.01
"""A left keypoint that is further to the right of the right one than this is on the wrong side."""
MIRRORED_M = 0.005
UPRIGHT = 0.5
"""Least cosine of the angles of the root's x axis to forward and of its z axis to up."""
MOST_DAMPING = 2.0
"""Largest stable damping of a hinge times the time step, in multiples of its inertia."""
HINGE_KEYS = (
    *("rest_pose", "stand_pose", "torque_limits", "speed_limits", "armature", "stiffness"),
    *("damping", "natural_frequency", "damping_ratio", "action_scale"),
)
"""Keys of a description that name hinges of the compiled robot."""
PAIRS = tuple(key.removeprefix("left_") for key in (*KEYPOINTS, *TOES) if key.startswith("left_"))


def problems(description: RobotDescription) -> list[str]:
    """Return what is wrong, a line each; a description without problems is that of a robot that
    loads."""
    found = list(dict.fromkeys(_unknown_names(description)))
    if found:
        return found
    try:
        robot = load_robot(description)
    except RoboJacksonError as cause:
        return [str(cause)]
    ranges = (*_out_of_range(robot), *_welded_out_of_range(description))
    return [*_upright(robot), *ranges, *_sides(robot), *unstable_gains(robot)]


def unstable_gains(
    robot: Robot, damping: Float[np.ndarray, " J"] | None = None, place: str = ""
) -> Iterator[str]:
    """Yield a line about the hinge whose damping is the furthest from stable, if one is not.

    A hinge that feels the inertia I turns at (1 - kd h / I) v after a step h in which the torque of
    its damping kd at the speed v was held: beyond 2 it swings up to its torque limit.

    Args:
        damping: Derivative gain a hinge, Nm s/rad; the robot's own when None.
        place: Where that is set; the robot's YAML when empty.
    """
    timestep, inertia = float(robot.model.opt.timestep), hinge_inertia(robot)
    damping = np.where(robot.actuated, robot.actuation.damping if damping is None else damping, 0.0)
    ratio = damping * timestep / inertia
    worst, count = int(np.argmax(ratio)), int((ratio > MOST_DAMPING).sum())
    if not count:
        return
    others = f" ({count} hinges are above)" if count > 1 else ""
    armature = robot.model.dof_armature[6 + worst] + (ratio[worst] - 1) * inertia[worst]
    yield (
        f"{place or where(robot.description, 'damping')}: the gains of "
        f"{robot.joint_names[worst]!r} are unstable: damping {damping[worst]:.3g} Nm s/rad x "
        f"timestep {timestep:g} s / inertia {inertia[worst]:.2g} kg m^2 = {ratio[worst]:.3g}, "
        f"at most {MOST_DAMPING:g} is stable"
        f"{others}; name its motor's armature ({armature:.2g} makes it 1), less damping "
        f"({inertia[worst] / timestep:.2g}) or a shorter simulation.timestep"
    )


def hinge_inertia(robot: Robot) -> Float[np.ndarray, " J"]:
    """Return the inertia that a torque on each hinge feels in the rest pose, kg m^2: 1 over the
    diagonal of the inverse mass matrix."""
    model, data = robot.model, mujoco.MjData(robot.model)
    data.qpos[:] = robot.standing
    mujoco.mj_forward(model, data)
    inverse = np.zeros((model.nv, model.nv))
    mujoco.mj_solveM(model, data, inverse, np.eye(model.nv))
    result: np.ndarray = 1.0 / np.diag(inverse)[6:]
    return result


def _unknown_names(description: RobotDescription) -> Iterator[str]:
    """Yield what the model or the description has no name for."""
    try:
        spec = read_spec(mjcf_path(description), description)
        fix_joints(spec, description)
        model = spec.compile()
    except RoboJacksonError as cause:
        yield str(cause).splitlines()[0]
        return
    except FAULTS as cause:
        yield f"{where(description, 'mjcf')}: {first_line(cause)}"
        return
    bodies = tuple(model.body(index).name for index in range(1, model.nbody))
    joints = tuple(model.joint(index).name for index in range(1, model.njnt))
    sites = description.sites
    wrong_joints = list(_joint_faults(model, description))
    yield from wrong_joints or unit_faults(model, description)
    yield from _error(check_floor, model, description)
    for key in KEYPOINTS + (TOES if set(TOES) & set(sites) else ()):
        if key not in sites:
            yield f"{where(description, 'sites')}: missing {key}"
    for key, (body, _) in sites.items():
        yield from _error(known, "keypoint", key, KEYPOINTS + TOES, where(description, "sites"))
        yield from _error(known, "body", body, bodies, where(description, f"sites.{key}"))
    if not description.contacts:
        yield f"{where(description, 'contacts')}: a robot needs feet"
    for name in description.contacts:
        yield from _error(check_contact, description, name, bodies)
    for key in description.weights:
        yield from _error(known, "keypoint", key, sites, where(description, "weights"))
    for section in HINGE_KEYS:
        for name in getattr(description, section):
            yield from _error(matching, "joint", name, joints, where(description, section))


def _error(check: Callable[..., Any], *given: Any) -> Iterator[str]:
    try:
        check(*given)
    except RoboJacksonError as cause:
        yield str(cause)


def _joint_faults(model: mujoco.MjModel, description: RobotDescription) -> Iterator[str]:
    try:
        yield from joint_faults(model, description)
    except RoboJacksonError as cause:
        yield str(cause)


def _upright(robot: Robot) -> Iterator[str]:
    """Yield a root whose own axes are others: its heading and its falls would be measured wrong."""
    data = mujoco.MjData(robot.model)
    mujoco.mj_kinematics(robot.model, data)
    axes = data.xmat[robot.model.body(robot.description.root_body).id].reshape(3, 3)
    if axes[0, 0] < UPRIGHT or axes[2, 2] < UPRIGHT:
        yield (
            f"{where(robot.description, 'root_body')}: the axes of {robot.description.root_body!r} "
            "are not x forward and z up where the model stands, and a fall is measured by them; in "
            "the MJCF, put the free joint on a body around it that has no rotation"
        )


def _out_of_range(robot: Robot) -> Iterator[str]:
    """Yield the angles of rest and stand beyond a limit: the robot would not stand as its soles
    were checked."""
    for key, pose in (("rest_pose", robot.rest), ("stand_pose", robot.stand)):
        given = np.where(pose == 0.0, np.nan, pose)  # zero where nothing is given
        place = where(robot.description, key)
        yield from _beyond(place, robot.joint_names, given, robot.lower, robot.upper)


def _welded_out_of_range(description: RobotDescription) -> Iterator[str]:
    """Yield the angles beyond a limit at which hinges are welded."""
    if not any(description.fixed_joints.values()):
        return
    model = read_spec(mjcf_path(description), description).compile()
    hinges = np.flatnonzero(model.jnt_limited & (model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE))
    joints, place = tuple(model.joint(index).name for index in hinges), "fixed_joints"
    limited = {
        pattern: angle
        for pattern, angle in description.fixed_joints.items()
        if any(fnmatchcase(name, pattern) for name in joints)
    }
    angles = per_hinge(limited, joints, where(description, place))
    yield from _beyond(where(description, place), joints, angles, *model.jnt_range[hinges].T)


def _beyond(
    place: str,
    joints: Sequence[str],
    angles: Float[np.ndarray, " J"],
    lower: Float[np.ndarray, " J"],
    upper: Float[np.ndarray, " J"],
) -> Iterator[str]:
    """Yield the angles, radians, beyond their ranges; NaN where none is given."""
    for name, angle, low, high in zip(joints, angles, lower, upper, strict=True):
        if angle < low or angle > high:
            yield f"{place}.{name} is {angle:g}: beyond its range, {low:.3g} to {high:.3g} radians"


def _sides(robot: Robot) -> Iterator[str]:
    """Yield the keypoints that are on the other side, or not mirrored, in the zero pose."""
    description, data = robot.description, mujoco.MjData(robot.model)
    mujoco.mj_kinematics(robot.model, data)
    at = dict(zip(robot.keypoint_names, data.site_xpos[robot.keypoint_sites], strict=True))
    middle = data.xpos[robot.model.body(description.root_body).id][1]
    for name in PAIRS:
        if f"left_{name}" not in at:
            continue
        left, right = at[f"left_{name}"], at[f"right_{name}"]
        mirrored = right * [1.0, -1.0, 1.0] + [0.0, 2 * middle, 0.0]
        place = where(description, f"sites.left_{name}")
        if left[1] < right[1] - SWAPPED_M:
            yield f"{place} is to the right of right_{name}; the robot faces along x, left is +y"
        elif np.linalg.norm(left - mirrored) > MIRRORED_M:
            apart = 1e3 * np.linalg.norm(left - mirrored)
            yield f"{place} is {apart:.0f} mm from the mirror image of right_{name}"
