"""What a robot description adds to its MJCF before it is compiled: motors, armature, stepping.

Metres, seconds, newton-metres. What the description does not name stays as the MJCF has it, so a
description without these keys compiles to the stock model.
"""

import mujoco

from robojackson.robot.actuation import per_hinge
from robojackson.robot.description import RobotDescription
from robojackson.robot.names import where

SAME_S = 1e-9


def apply_physics(spec: mujoco.MjSpec, description: RobotDescription) -> None:
    """Write armature, motors, friction and the stepping of the description into a spec.

    A hinge with a torque limit that no actuator of the MJCF drives gets a torque motor: its gear
    is the limit, its control -1..1.

    Raises:
        UnknownName: a hinge or pattern that matches none.
    """
    hinges = [joint for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE]
    names = tuple(joint.name for joint in hinges)
    armature = per_hinge(description.armature, names, where(description, "armature"))
    limits = per_hinge(description.torque_limits, names, where(description, "torque_limits"))
    driven = {actuator.target for actuator in spec.actuators}
    for hinge, inertia, limit in zip(hinges, armature, limits, strict=True):
        if inertia == inertia:  # a number
            hinge.armature = inertia
        if limit == limit and hinge.name not in driven:
            _add_motor(spec, hinge.name, float(limit))
    _step_as(spec, description)


def _add_motor(spec: mujoco.MjSpec, hinge: str, limit: float) -> None:
    motor = spec.add_actuator(name=hinge, target=hinge, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    motor.gear = [limit, 0, 0, 0, 0, 0]
    motor.ctrllimited = True
    motor.ctrlrange = [-1.0, 1.0]


def _step_as(spec: mujoco.MjSpec, description: RobotDescription) -> None:
    stepping = description.simulation
    if stepping.timestep is not None:
        spec.option.timestep = stepping.timestep
    if stepping.integrator is not None:
        spec.option.integrator = integrator_of(stepping.integrator)
    if stepping.iterations is not None:
        spec.option.iterations = stepping.iterations
    if stepping.ls_iterations is not None:
        spec.option.ls_iterations = stepping.ls_iterations
    if stepping.friction is not None:
        soles = {point.body for point in description.contacts.values()}
        floors = [geom for geom in spec.worldbody.geoms if is_plane(geom)]
        for geom in floors + [geom for body in soles for geom in spec.body(body).geoms]:
            geom.friction = [stepping.friction, *geom.friction[1:]]


def integrator_of(name: str) -> mujoco.mjtIntegrator:
    """MuJoCo's integrator of a name: Euler, RK4, implicit or implicitfast."""
    return getattr(mujoco.mjtIntegrator, f"mjINT_{name.upper()}")


def is_plane(geom: mujoco.MjsGeom) -> bool:
    """Whether a geom of a spec is an endless floor."""
    return bool(geom.type == mujoco.mjtGeom.mjGEOM_PLANE)


def substeps_of(control_dt: float, timestep: float) -> int | None:
    """Physics substeps of a control step; None where that is no whole number."""
    count = round(control_dt / timestep)
    whole = count >= 1 and abs(count * timestep - control_dt) < SAME_S
    return count if whole else None
