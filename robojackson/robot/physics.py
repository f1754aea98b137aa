"""Changes to an MJCF before it is compiled: joints, motors, stepping of the description.

Metres, seconds, newton-metres. What the description does not name stays as the MJCF has it, so a
description without these keys compiles to the stock model.
"""

from collections.abc import Callable, Iterator

import mujoco
import numpy as np

from robojackson.robot.actuation import both_ways, per_hinge
from robojackson.robot.description import RobotDescription
from robojackson.robot.fixed_joints import fix_joints, remove
from robojackson.robot.model_files import free_name
from robojackson.robot.names import known, where

IsSolid = Callable[[mujoco.MjsGeom], bool]
SAME_S = 1e-9
MOST_SUBSTEPS = 1000
"""Largest number of physics steps in a control step."""


def apply_physics(spec: mujoco.MjSpec, description: RobotDescription) -> None:
    """Write joints, armature, motors, friction and the stepping of the description into a spec.

    A hinge with a torque limit that no torque motor of the MJCF drives gets one: its gear is the
    limit, its control -1..1; one that the MJCF has gets another control range, where its limit is
    another. A position or velocity servo of that hinge goes: the PD law is ours.

    Raises:
        UnknownName: a hinge, body or pattern that matches none.
    """
    fix_joints(spec, description)
    _exclude(spec, description)
    hinges = [joint for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE]
    names = tuple(joint.name for joint in hinges)
    armature = per_hinge(description.armature, names, where(description, "armature"))
    limits = per_hinge(description.torque_limits, names, where(description, "torque_limits"))
    limited = {name for name, limit in zip(names, limits, strict=True) if limit == limit}
    _remove_servos(spec, limited)
    motors = _motors(spec)
    for hinge, inertia, limit in zip(hinges, armature, limits, strict=True):
        if inertia == inertia:  # a number
            hinge.armature = inertia
        if hinge.name not in limited:  # its motors are scaled where the gears are
            hinge.actfrcrange = np.asarray(hinge.actfrcrange) * description.gear_scale
            continue
        _bound(hinge, float(limit) * description.gear_scale)
        if hinge.name in motors:
            _limit(motors[hinge.name], float(limit))
        else:
            _add_motor(spec, hinge.name, float(limit))
    _step_as(spec, description)


def _exclude(spec: mujoco.MjSpec, description: RobotDescription) -> None:
    place = where(description, "collision_excludes")
    bodies = [body.name for body in spec.bodies]
    for pair in description.collision_excludes:
        first, second = (known("body", name, bodies, place) for name in pair)
        spec.add_exclude(bodyname1=first, bodyname2=second)


def _remove_servos(spec: mujoco.MjSpec, hinges: set[str]) -> None:
    none = mujoco.mjtBias.mjBIAS_NONE
    servos = {
        index
        for index, actuator in enumerate(spec.actuators)
        if actuator.target in hinges and actuator.biastype != none
    }
    if servos:
        remove(spec, actuators=servos)


def _motors(spec: mujoco.MjSpec) -> dict[str, list[mujoco.MjsActuator]]:
    """Return the actuators of each joint."""
    found: dict[str, list[mujoco.MjsActuator]] = {}
    for actuator in spec.actuators:
        if actuator.trntype == mujoco.mjtTrn.mjTRN_JOINT:
            found.setdefault(actuator.target, []).append(actuator)
    return found


def _bound(hinge: mujoco.MjsJoint, limit: float) -> None:
    """Let the bound that an MJCF gives to the torque of a hinge be a limit, Nm."""
    if np.any(hinge.actfrcrange) and not np.isclose(both_ways(hinge.actfrcrange), limit):
        hinge.actfrcrange = [-limit, limit]


def _limit(motors: list[mujoco.MjsActuator], limit: float) -> None:
    """Give the motors of one joint the control ranges with which they give a torque at most, Nm,
    where control and force ranges allow another."""
    factors = [abs(each.gear[0] * each.gainprm[0]) for each in motors]
    reach = [f * np.abs(each.ctrlrange).max() for f, each in zip(factors, motors, strict=True)]
    if np.isclose(sum(map(_within_force, motors, reach)), limit):
        return
    for each, factor in zip(motors, factors, strict=True):
        each.forcelimited = False
        if sum(reach) > 0:
            each.ctrlrange = np.asarray(each.ctrlrange) * (limit / sum(reach))
        elif factor > 0:  # no range in the MJCF
            each.ctrlrange = np.array([-1.0, 1.0]) * limit / (factor * len(motors))
            each.ctrllimited = True


def _within_force(motor: mujoco.MjsActuator, torque: float) -> float:
    """Return a torque, Nm, within what the force range of a motor allows, if it has one."""
    force = abs(motor.gear[0]) * both_ways(motor.forcerange)
    return float(min(torque, force)) if force > 0 else float(torque)


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
        _rub(spec, description, stepping.friction)


def _rub(spec: mujoco.MjSpec, description: RobotDescription, friction: float) -> None:
    """Write the sliding friction of floor and feet, and of the pairs of both."""
    soles, solid = {point.body for point in description.contacts.values()}, solid_in(spec)
    floors = [geom for geom in spec.geoms if _is_floor(geom, solid)]
    # A body that the model has not is refused by name where contacts are bound.
    bodies = [body for name in sorted(soles) if (body := spec.body(name)) is not None]
    rubbing = floors + [geom for body in bodies for geom in _foot_geoms(body, solid)]
    for geom in rubbing:
        geom.friction = [friction, *geom.friction[1:]]
    named = {geom.name for geom in rubbing}
    for pair in spec.pairs:
        if {pair.geomname1, pair.geomname2} <= named:
            pair.friction = [friction, friction, *pair.friction[2:]]


def solid_in(spec: mujoco.MjSpec) -> IsSolid:
    """Return the test of whether a geom of a spec can touch another: `body_states.solid_geoms`."""
    paired = {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}

    def is_solid(geom: mujoco.MjsGeom) -> bool:
        return bool(geom.contype or geom.conaffinity or geom.name in paired)

    return is_solid


def _foot_geoms(body: mujoco.MjsBody, solid: IsSolid) -> list[mujoco.MjsGeom]:
    """Return the geoms of the foot of a contact's body: `body_states.foot_bodies` of a spec."""
    geoms = list(_geoms_below(body))
    while not (body.joints or any(map(solid, geoms))):
        if body.parent.name == "world":
            break
        body = body.parent
        geoms = list(_geoms_below(body))
    return geoms


def _geoms_below(body: mujoco.MjsBody) -> Iterator[mujoco.MjsGeom]:
    """Yield the geoms of a body and of those that are welded below it."""
    yield from body.geoms
    for child in body.bodies:
        if not child.joints:
            yield from _geoms_below(child)


def integrator_of(name: str) -> mujoco.mjtIntegrator:
    """Return MuJoCo's integrator of a name: Euler, RK4, implicit or implicitfast."""
    return getattr(mujoco.mjtIntegrator, f"mjINT_{name.upper()}")


def add_floor(spec: mujoco.MjSpec) -> None:
    """Add a floor at z = 0 to a spec that has none."""
    solid = solid_in(spec)
    if any(_is_floor(geom, solid) for geom in spec.geoms):
        return
    name = free_name("floor", [geom.name for geom in spec.geoms])
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    spec.worldbody.add_geom(name=name, type=plane, size=[40, 40, 1], rgba=[0.5] * 3 + [1])


def _is_floor(geom: mujoco.MjsGeom, solid: IsSolid) -> bool:
    """Return whether a geom of a spec is a plane that is not there for its looks alone."""
    return bool(geom.type == mujoco.mjtGeom.mjGEOM_PLANE and solid(geom))


def substeps_of(control_dt: float, timestep: float) -> int | None:
    """Return the physics substeps of a control step; None where that is no whole number
    up to `MOST_SUBSTEPS`."""
    count = round(control_dt / timestep)
    whole = 1 <= count <= MOST_SUBSTEPS and abs(count * timestep - control_dt) < SAME_S
    return count if whole else None
