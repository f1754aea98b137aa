"""A tracker's settings bound to the hinges of its robot.

Effort limits, friction and masses stay the robot's: only the gains of the PD law are the tracker's,
as in its network's training, and the physics step if these gains need a shorter one.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.errors import BadConfiguration, BadPolicy
from robojackson.rl.sim.motors import Motors
from robojackson.rl.sim.variation import Variation, varied
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.actuation import per_hinge
from robojackson.robot.model import Robot
from robojackson.robot.names import known, matching

CLOCK_S = 1e-9


@dataclass(frozen=True)
class Layout:
    """Hinges of a tracker in terms of its robot's; radians.

    Attributes:
        order: Index in `qpos[7:]` of every hinge of the tracker.
        motors: The tracker's hinge of every motor.
        default: Angles that an action of 0 holds, in the tracker's order.
        measured: Whether the tracker gets a hinge's speed, in the tracker's order.
    """

    order: Int[np.ndarray, " J"]
    motors: Int[np.ndarray, " nu"]
    default: Float[np.ndarray, " J"]
    measured: Bool[np.ndarray, " J"]


def equip(robot: Robot, tracker: TrackerDescription) -> Robot:
    """Return the robot with the tracker's gains and physics step.

    Raises:
        BadPolicy: the tracker is for another robot or another control step.
        UnknownName: the tracker has a hinge that the robot lacks.
        BadConfiguration: a hinge without a gain, or a step that does not divide the control step.
    """
    require_robot(robot, tracker)
    stiffness, damping = (_gains(robot, tracker, key) for key in ("stiffness", "damping"))
    own = replace(robot.actuation, stiffness=stiffness, damping=damping)
    return varied(replace(robot, actuation=own), Variation(timestep=tracker.timestep))


def layout_of(robot: Robot, tracker: TrackerDescription) -> Layout:
    """Bind the hinges of a tracker to its robot.

    Raises:
        BadPolicy: the tracker is for another robot or another control step.
        UnknownName: the tracker has a hinge that the robot lacks.
        BadConfiguration: the tracker does not drive a hinge of the robot.
    """
    require_robot(robot, tracker)
    own, joints = robot.joint_names, tracker.joints
    place = _place(tracker, "joints")
    order = np.array([own.index(known("joint", name, own, place)) for name in joints])
    missing = [name for name in own if name not in joints]
    if missing or len(set(joints)) != len(joints):
        problem = f"{missing[0]!r} is missing" if missing else "a joint is named twice"
        raise BadConfiguration(f"{place}: {problem}")
    silent: set[str] = set()
    for pattern in tracker.unmeasured_speeds:
        silent |= set(matching("joint", pattern, joints, _place(tracker, "unmeasured_speeds")))
    default = per_hinge(tracker.default_pose, joints, _place(tracker, "default_pose"))
    return Layout(
        order=order,
        motors=np.argsort(order)[Motors.of(robot.model).hinge],
        default=np.nan_to_num(default),
        measured=np.array([name not in silent for name in joints]),
    )


def require_robot(robot: Robot, tracker: TrackerDescription) -> None:
    """Raise for another robot than the tracker's.

    Raises:
        BadPolicy: the tracker is for another robot or another control step.
    """
    name, dt = robot.description.name, robot.description.control_dt
    if name != tracker.robot:
        raise BadPolicy(tracker.why_not(name))
    if abs(dt - tracker.control_dt) > CLOCK_S:
        raise BadPolicy(
            f"tracker {tracker.name!r} acts every {1e3 * tracker.control_dt:g} ms and robot "
            f"{name!r} every {1e3 * dt:g} ms"
        )


def _gains(robot: Robot, tracker: TrackerDescription, key: str) -> Float[np.ndarray, " J"]:
    place = _place(tracker, key)
    values = per_hinge(getattr(tracker, key), robot.joint_names, place)
    if np.isnan(values).any():
        name = robot.joint_names[int(np.argmax(np.isnan(values)))]
        raise BadConfiguration(f"{place}: none for joint {name!r}")
    return values


def _place(tracker: TrackerDescription, key: str) -> str:
    return f"configs/trackers/{tracker.name}.yaml: {key}"
