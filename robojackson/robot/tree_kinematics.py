"""Forward kinematics and Jacobians of a MuJoCo tree over a whole clip at once.

The same results as `mj_kinematics` and `mj_jac`, without a Python loop over frames. Tangent space
of MuJoCo: root linear in the world, root angular in the body, hinges. World, metres, radians.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from robojackson.geometry.rotations import (
    from_rotation,
    quat_conjugate,
    quat_multiply,
    quat_to_matrix,
    sign_continuous,
    to_rotation,
)
from robojackson.robot.linkage import Tree as Tree
from robojackson.robot.linkage import tree as tree
from robojackson.robot.model import Robot


@dataclass(frozen=True)
class Posed:
    """The tree in T poses: bodies, hinge axes and anchors, keypoints, centres of balls; world."""

    body_pos: Float[np.ndarray, "T B 3"]
    body_rot: Float[np.ndarray, "T B 3 3"]
    anchor: Float[np.ndarray, "T J 3"]
    axis: Float[np.ndarray, "T J 3"]
    site_pos: Float[np.ndarray, "T K 3"]
    ball_pos: Float[np.ndarray, "T C 3"]
    root: int

    def __getitem__(self, frames: Int[np.ndarray, " M"]) -> "Posed":
        """Return some of the poses."""
        arrays = ("body_pos", "body_rot", "anchor", "axis", "site_pos", "ball_pos")
        return replace(self, **{name: getattr(self, name)[frames] for name in arrays})

    @cached_property
    def screws(self) -> tuple[np.ndarray, np.ndarray]:
        """Axes and moments about the origin of all degrees of freedom, (T, 3, nv) each."""
        frames, count = self.axis.shape[:2]
        axis, moment = np.zeros((2, frames, 3, 6 + count))
        axis[:, :, 3:6] = self.body_rot[:, self.root]
        axis[:, :, 6:] = self.axis.swapaxes(1, 2)
        moment[:, [0, 1, 2], [0, 1, 2]] = 1.0
        at = self.body_pos[:, self.root, :, None]
        moment[:, :, 3:6] = _cross(at, axis[:, :, 3:6])
        moment[:, :, 6:] = _cross(self.anchor.swapaxes(1, 2), axis[:, :, 6:])
        return axis, moment


def pose(
    tree: Tree, qpos: Float[np.ndarray, "T nq"], bodies_only: Sequence[int] | None = None
) -> Posed:
    """Return the forward kinematics of every frame (equations of `mj_kinematics`).

    Args:
        bodies_only: Bodies to place, in the order of the tree and with all that they hang from
            (`above`); the others stay at the origin. None places all.
    """
    frames, bodies, joints = len(qpos), len(tree.parent), len(tree.zero)
    body_pos, body_rot = np.zeros((frames, bodies, 3)), np.zeros((frames, bodies, 3, 3))
    anchor, axis = np.zeros((frames, joints, 3)), np.zeros((frames, joints, 3))
    body_rot[:, 0] = np.eye(3)
    angle = qpos[:, 7:] - tree.zero
    for body in range(1, bodies) if bodies_only is None else bodies_only:
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
    return placed(tree, body_pos, body_rot, anchor, axis)


def above(tree: Tree, bodies: Int[np.ndarray, " N"]) -> tuple[int, ...]:
    """Return bodies and all that they hang from but the world, in the order of the tree."""
    found = set[int]()
    for body in bodies.tolist():
        while body > 0:
            found.add(body)
            body = int(tree.parent[body])
    return tuple(sorted(found))


def placed(
    tree: Tree, body_pos: np.ndarray, body_rot: np.ndarray, anchor: np.ndarray, axis: np.ndarray
) -> Posed:
    """Return the keypoints and balls on bodies that are placed already."""
    sites = _fixed(body_pos, body_rot, tree.site_body, tree.site_position)
    balls = _fixed(body_pos, body_rot, tree.ball_body, tree.ball_position)
    return Posed(body_pos, body_rot, anchor, axis, sites, balls, tree.root)


def _fixed(
    body_pos: np.ndarray, body_rot: np.ndarray, bodies: np.ndarray, at: np.ndarray
) -> np.ndarray:
    """Return the world positions of points fixed to bodies."""
    return np.asarray(body_pos[:, bodies] + (body_rot[:, bodies] @ at[..., None])[..., 0])


def point_jacobian(
    tree: Tree, posed: Posed, points: Float[np.ndarray, "T P 3"], bodies: Int[np.ndarray, "*T P"]
) -> Float[np.ndarray, "T P 3 nv"]:
    """Return the world Jacobian of points fixed to bodies (`mj_jac`): columns axis x (point -
    anchor).

    One matrix product a frame: axis x p - axis x anchor = -[p]x axis + anchor x axis.
    """
    frames, count = points.shape[:2]
    axis, moment = posed.screws
    out = (_minus_skew(points).reshape(frames, 3 * count, 3) @ axis).reshape(frames, count, 3, -1)
    out += moment[:, None]
    out *= tree.moved_by[bodies][..., None, :]
    return np.asarray(out)


def centre_of_mass(tree: Tree, posed: Posed) -> Float[np.ndarray, "T 3"]:
    """Return the centre of mass of the robot."""
    return np.asarray(tree.mass @ _body_coms(tree, posed) / tree.mass.sum())


def com_jacobian(tree: Tree, posed: Posed) -> Float[np.ndarray, "T 3 nv"]:
    """Return Jacobian of the centre of mass: each axis turns the mass that hangs on it."""
    share = tree.mass[:, None] / tree.mass.sum() * tree.moved_by
    arms = _body_coms(tree, posed).swapaxes(1, 2) @ share
    axis, moment = posed.screws
    return np.asarray(_cross(axis, arms) + moment * share.sum(axis=0))


def _body_coms(tree: Tree, posed: Posed) -> Float[np.ndarray, "T B 3"]:
    return np.asarray(posed.body_pos + (posed.body_rot @ tree.com[..., None])[..., 0])


def _cross(a: Float[np.ndarray, "T 3 N"], b: Float[np.ndarray, "T 3 N"]) -> np.ndarray:
    """Cross product along the middle axis."""
    (ax, ay, az), (bx, by, bz) = np.moveaxis(a, 1, 0), np.moveaxis(b, 1, 0)
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def sole_velocities(
    robot: Robot, posed: Posed, dt: float, cycle_offset: Float[np.ndarray, "3"] | None
) -> Float[np.ndarray, "M C 2"]:
    """Return the horizontal velocity of each ball's ground point from each step to the next, m/s.

    (c_next - c) / dt - r (w_y, -w_x), with w from the turn of the foot between the steps: a ball
    that rolls without slip has none. A cycle has one more than an open motion.
    """
    centre = posed.ball_pos
    move = np.roll(centre, -1, axis=0) - centre
    if cycle_offset is not None:
        move[-1] += cycle_offset
    turn = posed.body_rot[:, robot.contact_bodies]
    relative = np.roll(turn, -1, axis=0) @ turn.swapaxes(-1, -2)
    spin = _small_turns(relative)
    rolled = robot.contact_radii[:, None] * np.stack([spin[..., 1], -spin[..., 0]], -1)
    out = (move[..., :2] - rolled) / dt
    return np.asarray(out if cycle_offset is not None else out[:-1])


def integrate(
    qpos: Float[np.ndarray, "T nq"], tangent: Float[np.ndarray, "T nv"]
) -> Float[np.ndarray, "T nq"]:
    """Return qpos moved by a tangent vector (`mj_integratePos` with unit time)."""
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
    """Return the tangent vector from start to end (`mj_differentiatePos` with unit time)."""
    turn = to_rotation(quat_multiply(quat_conjugate(start[:, 3:7]), end[:, 3:7])).as_rotvec()
    return np.concatenate([end[:, :3] - start[:, :3], turn, end[:, 7:] - start[:, 7:]], axis=1)


def continuous(qpos: Float[np.ndarray, "T nq"]) -> Float[np.ndarray, "T nq"]:
    """Return the same motion with root quaternions of continuous sign."""
    return np.concatenate([qpos[:, :3], sign_continuous(qpos[:, 3:7]), qpos[:, 7:]], axis=1)


def _small_turns(matrix: Float[np.ndarray, "*B 3 3"]) -> Float[np.ndarray, "*B 3"]:
    """Return the rotation vectors of turns under a right angle; NaN stays NaN."""
    skew = (matrix - matrix.swapaxes(-1, -2)) / 2
    sine_axis = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], -1)
    sine = np.linalg.norm(sine_axis, axis=-1, keepdims=True).clip(1e-12)
    return np.asarray(sine_axis * np.arcsin(sine.clip(max=1.0)) / sine)


def _about(axis: Float[np.ndarray, "3"], angle: Float[np.ndarray, " T"]) -> np.ndarray:
    """Return the rotation matrices about a fixed unit axis (Rodrigues)."""
    x, y, z = axis
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sine, cosine = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    result: np.ndarray = np.eye(3) + sine * skew + (1 - cosine) * (skew @ skew)
    return result


def _minus_skew(v: Float[np.ndarray, "T P 3"]) -> Float[np.ndarray, "T P 3 3"]:
    """Return minus the cross product matrices: the matrix of w -> w x v."""
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 1, 2], out[..., 2, 0] = v[..., 2], v[..., 0], v[..., 1]
    out[..., 1, 0], out[..., 2, 1], out[..., 0, 2] = -v[..., 2], -v[..., 0], -v[..., 1]
    return out
