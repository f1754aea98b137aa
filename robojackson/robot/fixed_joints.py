"""Hinges of an MJCF that a robot goes without: welded at an angle before the model is compiled.

The bodies stay, with their masses, geoms and names; what refers to a removed joint goes with it.
Metres, radians.
"""

from collections.abc import Collection, Mapping

import mujoco
import numpy as np

from robojackson.robot.actuation import per_hinge
from robojackson.robot.description import RobotDescription
from robojackson.robot.names import where

_JOINT, _TENDON = mujoco.mjtObj.mjOBJ_JOINT, mujoco.mjtObj.mjOBJ_TENDON
_NONE: frozenset[str] = frozenset()


def fix_joints(spec: mujoco.MjSpec, description: RobotDescription) -> None:
    """Remove the hinges of `fixed_joints` from a spec, each welded at its angle.

    Raises:
        UnknownName: a pattern that matches no hinge.
    """
    if not description.fixed_joints:
        return
    hinges = [joint.name for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE]
    place = where(description, "fixed_joints")
    angles = per_hinge(description.fixed_joints, tuple(hinges), place)
    fixed = {
        name: float(angle)
        for name, angle in zip(hinges, angles, strict=True)
        if angle == angle  # a number
    }
    if any(angle or spec.joint(name).ref for name, angle in fixed.items()):
        _weld(spec, fixed)
    remove(spec, joints=set(fixed))


def remove(
    spec: mujoco.MjSpec,
    joints: Collection[str] = frozenset(),
    actuators: Collection[int] = frozenset(),
) -> None:
    """Delete joints by name, actuators by index, and everything that refers to them.

    That is tendons over the joints; actuators, equality constraints and sensors of joints and
    tendons; sensors of the actuators; and all keyframes, which hold a number a joint and actuator.
    """
    wrap = mujoco.mjtWrap.mjWRAP_JOINT
    tendons = [
        tendon
        for tendon in spec.tendons
        if any(each.type == wrap and each.target.name in joints for each in tendon.path)
    ]
    gone = {_JOINT: set(joints), _TENDON: {tendon.name for tendon in tendons}}
    driven = [
        each
        for index, each in enumerate(spec.actuators)
        if index in actuators or each.target in gone.get(_moved(each), _NONE)
    ]
    gone[mujoco.mjtObj.mjOBJ_ACTUATOR] = {each.name for each in driven}
    coupled = [
        each
        for each in spec.equalities
        if {each.name1, each.name2} & gone.get(_coupled(each), _NONE)
    ]
    felt = [each for each in spec.sensors if each.objname in gone.get(each.objtype, _NONE)]
    removed = [spec.joint(name) for name in joints]
    for element in (*spec.keys, *felt, *coupled, *driven, *tendons, *removed):
        spec.delete(element)


def _moved(actuator: mujoco.MjsActuator) -> mujoco.mjtObj:
    """Return the kind of element that an actuator drives."""
    kind = mujoco.mjtTrn
    if actuator.trntype in (kind.mjTRN_JOINT, kind.mjTRN_JOINTINPARENT):
        return _JOINT
    return _TENDON if actuator.trntype == kind.mjTRN_TENDON else mujoco.mjtObj.mjOBJ_UNKNOWN


def _coupled(equality: mujoco.MjsEquality) -> mujoco.mjtObj:
    """Return the kind of element that an equality constraint couples."""
    if equality.type == mujoco.mjtEq.mjEQ_JOINT:
        return _JOINT
    tendon = equality.type == mujoco.mjtEq.mjEQ_TENDON
    return _TENDON if tendon else mujoco.mjtObj.mjOBJ_UNKNOWN


def _weld(spec: mujoco.MjSpec, fixed: Mapping[str, float]) -> None:
    """Turn the bodies of the fixed hinges by their angles.

    A body's pose is T J1 J2 ..., with T its frame in its parent and Ji(q) the rotation by q - ref
    about its i-th hinge. With J2 fixed, T J1 J2 = (T J2) J1', where the axis of J1' is that of J1
    in the frame that J2 has turned.
    """
    model = spec.compile()
    turned: dict[int, np.ndarray] = {}
    for name, angle in fixed.items():
        joint = model.joint(name).id
        turn = angle - model.qpos0[model.jnt_qposadr[joint]]
        turned[joint] = _about(model.jnt_axis[joint], model.jnt_pos[joint], turn)
    for body in {int(model.jnt_bodyid[joint]) for joint in turned}:
        _turn_body(spec, model, body, turned)


def _turn_body(
    spec: mujoco.MjSpec, model: mujoco.MjModel, body: int, turned: Mapping[int, np.ndarray]
) -> None:
    first = int(model.body_jntadr[body])
    joints = range(first, first + int(model.body_jntnum[body]))
    product = np.eye(4)  # of the fixed rotations after the joint at hand
    for joint in reversed(joints):
        if joint in turned:
            product = turned[joint] @ product
            continue
        inverse = np.linalg.inv(product)
        moved = spec.joint(model.joint(joint).name)
        moved.axis = inverse[:3, :3] @ model.jnt_axis[joint]
        moved.pos = inverse[:3, :3] @ model.jnt_pos[joint] + inverse[:3, 3]
    here = spec.body(model.body(body).name)
    pose = _pose(model.body_pos[body], model.body_quat[body]) @ product
    here.set_frame(here.parent.add_frame())  # the compiled pose holds the MJCF's frames already
    here.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    here.pos, here.quat = pose[:3, 3], _quaternion(pose[:3, :3])


def _about(axis: np.ndarray, anchor: np.ndarray, angle: float) -> np.ndarray:
    """Return the rotation about an axis through a point, 4 x 4."""
    quaternion = np.empty(4)
    mujoco.mju_axisAngle2Quat(quaternion, axis, angle)
    result = _pose(np.zeros(3), quaternion)
    result[:3, 3] = anchor - result[:3, :3] @ anchor
    return result


def _pose(position: np.ndarray, quaternion: np.ndarray) -> np.ndarray:
    flat = np.empty(9)
    mujoco.mju_quat2Mat(flat, quaternion)
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = flat.reshape(3, 3), position
    return result


def _quaternion(rotation: np.ndarray) -> np.ndarray:
    result = np.empty(4)
    mujoco.mju_mat2Quat(result, np.ascontiguousarray(rotation).ravel())
    return result
