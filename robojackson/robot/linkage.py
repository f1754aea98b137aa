"""The constants of a kinematic tree, read from the MuJoCo model. Metres, radians, kilograms."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.geometry.rotations import quat_to_matrix
from robojackson.robot.body_states import own_bodies, own_mass
from robojackson.robot.model import Robot


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
        ball_body, ball_position: The centres of the balls under the feet.
        com, mass: Centres of mass in the bodies, metres; kilograms, of the robot's own bodies.
        own: Which bodies are the robot's.
        root: Body with the free joint.
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
    ball_body: Int[np.ndarray, " C"]
    ball_position: Float[np.ndarray, "C 3"]
    com: Float[np.ndarray, "B 3"]
    mass: Float[np.ndarray, " B"]
    own: Bool[np.ndarray, " B"]
    root: int

    @cached_property
    def moved_by(self) -> Float[np.ndarray, "B nv"]:
        """1 where a degree of freedom moves a body."""
        root = np.repeat(self.own.astype(float)[:, None], 6, axis=1)
        return np.concatenate([root, self.moves], axis=1)


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
        ball_body=robot.contact_bodies,
        ball_position=model.site_pos[robot.keypoint_sites[robot.contact_keypoints]]
        + robot.contact_offsets,
        com=model.body_ipos.copy(),
        mass=own_mass(model),
        own=own_bodies(model),
        root=int(model.jnt_bodyid[0]),
    )
