"""Forward kinematics and Jacobians of a MuJoCo tree over a whole clip at once.

The same results as `mj_kinematics` and `mj_jac`, without a Python loop over frames. Tangent space
of MuJoCo: root linear in the world, root angular in the body, hinges. World, metres, radians.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial.transform import Rotation

from robojackson.geometry.rotations import (
    from_rotation,
    quat_conjugate,
    quat_multiply,
    quat_to_matrix,
    sign_continuous,
    to_rotation,
)
from robojackson.retarget.robot import Robot


@dataclass(frozen=True)
class Tree:
    """The constants of the kinematic tree; bodies in MuJoCo's order, the world among them.

    Attributes:
        parent: Parent body.
        position, rotation: Pose of each body in its parent at zero angles.
        body_hinges: Hinge indices (order of qpos) of each body.
        anchor, axis: Hinge anchors and axes in their bodies.
        zero: Angle of each hinge in the zero pose (`qpos0`).
        moves: Whether hinge j moves body b.
        site_body, site_position: The keypoint sites.
        com, mass: Centres of mass in the bodies, metres; kilograms.
    """

    parent: Int[np.ndarray, " B"]
    position: Float[np.ndarray, "B 3"]
    rotation: Float[np.ndarray, "B 3 3"]
    body_hinges: tuple[tuple[int, ...], ...]
    anchor: Float[np.ndarray, "J 3"]
    axis: Float[np.ndarray, "J 3"]
    zero: Float[np.ndarray, " J"]
    moves: Bool[np.ndarray, "B J"]
    site_body: Int[np.ndarray, " K"]
    site_position: Float[np.ndarray, "K 3"]
    com: Float[np.ndarray, "B 3"]
    mass: Float[np.ndarray, " B"]
    root: int


@dataclass(frozen=True)
class Posed:
    """The tree in T poses: body poses, hinge axes and anchors, keypoint sites, world frame."""

    body_pos: Float[np.ndarray, "T B 3"]
    body_rot: Float[np.ndarray, "T B 3 3"]
    anchor: Float[np.ndarray, "T J 3"]
    axis: Float[np.ndarray, "T J 3"]
    site_pos: Float[np.ndarray, "T K 3"]


def tree(robot: Robot) -> Tree:
    """Read the constants of the tree from the model."""
    model = robot.model
    hinges: list[list[int]] = [[] for _ in range(model.nbody)]
    for joint in range(1, model.njnt):
        hinges[model.jnt_bodyid[joint]].append(joint - 1)
    moves = np.zeros((model.nbody, model.njnt - 1), bool)
    for body in range(1, model.nbody):
        moves[body] = moves[model.body_parentid[body]]
        moves[body, hinges[body]] = True
    return Tree(
        parent=model.body_parentid.copy(),
        position=model.body_pos.copy(),
        rotation=quat_to_matrix(model.body_quat / np.linalg.norm(model.body_quat, axis=1)[:, None]),
        body_hinges=tuple(tuple(h) for h in hinges),
        anchor=model.jnt_pos[1:].copy(),
        axis=model.jnt_axis[1:].copy(),
        zero=model.qpos0[7:].copy(),
        moves=moves,
        site_body=model.site_bodyid[robot.keypoint_sites].copy(),
        site_position=model.site_pos[robot.keypoint_sites].copy(),
        com=model.body_ipos.copy(),
        mass=model.body_mass.copy(),
        root=int(model.jnt_bodyid[0]),
    )


def pose(tree: Tree, qpos: Float[np.ndarray, "T nq"]) -> Posed:
    """Forward kinematics of every frame (equations of `mj_kinematics`)."""
    frames, bodies, joints = len(qpos), len(tree.parent), len(tree.zero)
    body_pos, body_rot = np.zeros((frames, bodies, 3)), np.zeros((frames, bodies, 3, 3))
    anchor, axis = np.zeros((frames, joints, 3)), np.zeros((frames, joints, 3))
    body_rot[:, 0] = np.eye(3)
    angle = qpos[:, 7:] - tree.zero
    for body in range(1, bodies):
        if body == tree.root:
            body_pos[:, body], body_rot[:, body] = qpos[:, :3], quat_to_matrix(qpos[:, 3:7])
            continue
        up = tree.parent[body]
        rot = body_rot[:, up] @ tree.rotation[body]
        pos = body_pos[:, up] + body_rot[:, up] @ tree.position[body]
        for hinge in tree.body_hinges[body]:
            anchor[:, hinge] = pos + rot @ tree.anchor[hinge]
            axis[:, hinge] = rot @ tree.axis[hinge]
            rot = rot @ _about(tree.axis[hinge], angle[:, hinge])
            pos = anchor[:, hinge] - rot @ tree.anchor[hinge]
        body_pos[:, body], body_rot[:, body] = pos, rot
    local = (body_rot[:, tree.site_body] @ tree.site_position[..., None])[..., 0]
    return Posed(body_pos, body_rot, anchor, axis, body_pos[:, tree.site_body] + local)


def point_jacobian(
    tree: Tree, posed: Posed, points: Float[np.ndarray, "T P 3"], bodies: Int[np.ndarray, "*T P"]
) -> Float[np.ndarray, "T P 3 nv"]:
    """World Jacobian of points fixed to bodies (`mj_jac`): columns axis x (point - anchor).

    One matrix product a frame: axis x p - axis x anchor = -[p]x axis + anchor x axis.
    """
    frames, count = points.shape[:2]
    axis, moment = _screws(tree, posed)
    out = (_minus_skew(points).reshape(frames, 3 * count, 3) @ axis).reshape(frames, count, 3, -1)
    out += moment[:, None]
    out *= _moved_by(tree)[bodies][..., None, :]
    return np.asarray(out)


def centre_of_mass(tree: Tree, posed: Posed) -> Float[np.ndarray, "T 3"]:
    """Centre of mass of the robot."""
    coms = posed.body_pos + (posed.body_rot @ tree.com[..., None])[..., 0]
    return np.asarray(tree.mass @ coms / tree.mass.sum())


def com_jacobian(tree: Tree, posed: Posed) -> Float[np.ndarray, "T 3 nv"]:
    """Jacobian of the centre of mass."""
    coms = posed.body_pos + (posed.body_rot @ tree.com[..., None])[..., 0]
    rows = point_jacobian(tree, posed, coms, np.arange(len(tree.parent)))
    return np.asarray(np.einsum("b,tbij->tij", tree.mass / tree.mass.sum(), rows))


def sole_velocities(
    robot: Robot, posed: Posed, dt: float, lap: Float[np.ndarray, "3"] | None
) -> Float[np.ndarray, "M C 2"]:
    """Horizontal velocity of each ball's ground point from each step to the next, m/s.

    (c_next - c) / dt - r (w_y, -w_x), with w from the turn of the foot between the steps: a ball
    that rolls without slip has none. A lap has one more than an open motion.
    """
    centre = posed.site_pos[:, robot.contact_keypoints]
    move = np.roll(centre, -1, axis=0) - centre
    if lap is not None:
        move[-1] += lap
    turn = posed.body_rot[:, robot.contact_bodies]
    relative = np.roll(turn, -1, axis=0) @ turn.swapaxes(-1, -2)
    spin = _small_turns(relative)
    rolled = robot.contact_radii[:, None] * np.stack([spin[..., 1], -spin[..., 0]], -1)
    out = (move[..., :2] - rolled) / dt
    return np.asarray(out if lap is not None else out[:-1])


def integrate(
    qpos: Float[np.ndarray, "T nq"], tangent: Float[np.ndarray, "T nv"]
) -> Float[np.ndarray, "T nq"]:
    """qpos moved by a tangent vector (`mj_integratePos` with unit time)."""
    out = np.empty_like(qpos)
    out[:, :3] = qpos[:, :3] + tangent[:, :3]
    turn = from_rotation(Rotation.from_rotvec(tangent[:, 3:6]))
    quat = quat_multiply(qpos[:, 3:7], turn)
    out[:, 3:7] = quat / np.linalg.norm(quat, axis=-1, keepdims=True)
    out[:, 7:] = qpos[:, 7:] + tangent[:, 6:]
    return out


def difference(
    start: Float[np.ndarray, "T nq"], end: Float[np.ndarray, "T nq"]
) -> Float[np.ndarray, "T nv"]:
    """Tangent vector from start to end (`mj_differentiatePos` with unit time)."""
    turn = to_rotation(quat_multiply(quat_conjugate(start[:, 3:7]), end[:, 3:7])).as_rotvec()
    return np.concatenate([end[:, :3] - start[:, :3], turn, end[:, 7:] - start[:, 7:]], axis=1)


def continuous(qpos: Float[np.ndarray, "T nq"]) -> Float[np.ndarray, "T nq"]:
    """The same motion with root quaternions of continuous sign."""
    return np.concatenate([qpos[:, :3], sign_continuous(qpos[:, 3:7]), qpos[:, 7:]], axis=1)


def _small_turns(matrix: Float[np.ndarray, "*B 3 3"]) -> Float[np.ndarray, "*B 3"]:
    """Rotation vectors of turns under a right angle; NaN stays NaN."""
    skew = (matrix - matrix.swapaxes(-1, -2)) / 2
    sine_axis = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], -1)
    sine = np.linalg.norm(sine_axis, axis=-1, keepdims=True).clip(1e-12)
    return np.asarray(sine_axis * np.arcsin(sine.clip(max=1.0)) / sine)


def _about(axis: Float[np.ndarray, "3"], angle: Float[np.ndarray, " T"]) -> np.ndarray:
    """Rotation matrices about a fixed unit axis (Rodrigues)."""
    x, y, z = axis
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sine, cosine = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + sine * skew + (1 - cosine) * (skew @ skew)


def _screws(tree: Tree, posed: Posed) -> tuple[np.ndarray, np.ndarray]:
    """Axes and moments about the origin of all degrees of freedom, (T, 3, nv) each."""
    frames, root = len(posed.axis), tree.root
    turn, at = posed.body_rot[:, root], posed.body_pos[:, root]
    axes = np.concatenate([turn.swapaxes(1, 2), posed.axis], axis=1)
    arms = np.concatenate([np.repeat(at[:, None], 3, axis=1), posed.anchor], axis=1)
    linear = np.broadcast_to(np.eye(3), (frames, 3, 3))
    axis = np.concatenate([np.zeros((frames, 3, 3)), axes.swapaxes(1, 2)], axis=2)
    moment = np.concatenate([linear, np.cross(arms, axes).swapaxes(1, 2)], axis=2)
    return axis, moment


def _moved_by(tree: Tree) -> Float[np.ndarray, "B nv"]:
    """1 where a degree of freedom moves a body."""
    root = np.ones((len(tree.parent), 6))
    root[0] = 0.0
    return np.concatenate([root, tree.moves], axis=1)


def _minus_skew(v: Float[np.ndarray, "T P 3"]) -> Float[np.ndarray, "T P 3 3"]:
    """Minus the cross product matrices: the matrix of w -> w x v."""
    x, y, z = np.moveaxis(v, -1, 0)
    o = np.zeros_like(x)
    rows = [np.stack(row, -1) for row in ((o, z, -y), (-z, o, x), (y, -x, o))]
    return np.stack(rows, -2)
