"""Touching geoms over a clip, from MuJoCo's own collision detection.

A contact counts from `clearance` above touching, so that the solver stops before it penetrates.
"""

import copy
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.retarget.feasibility.force_model import once_a_robot
from robojackson.robot.body_states import fixed_bodies
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import Posed, Tree, placed

_FLOOR_BIT = 1 << 30
_APART_M = 1e3
"""Depth that a pair which must not meet never reaches."""


@dataclass(frozen=True)
class Touches:
    """Contacts of a clip, one a row.

    Attributes:
        frame: Frame of each.
        distance: Metres, negative where the geoms overlap.
        position: Middle of the contact, metres, world.
        normal: Unit, from the first body to the second.
        bodies: The two bodies.
        floor: Whether the world, or a body that is fixed to it, is one of them.
    """

    frame: Int[np.ndarray, " M"]
    distance: Float[np.ndarray, " M"]
    position: Float[np.ndarray, "M 3"]
    normal: Float[np.ndarray, "M 3"]
    bodies: Int[np.ndarray, "M 2"]
    floor: Bool[np.ndarray, " M"]


class _Models:
    """Copies of a robot's model for the clearances in use: one with meshes is slow to copy."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._made: dict[tuple[float, bool], mujoco.MjModel] = {}

    def with_margin(self, clearance: float, feet: bool) -> mujoco.MjModel:
        """Return the copy in which geoms touch below the clearance."""
        if (clearance, feet) not in self._made:
            model = copy.copy(self._robot.model)
            model.geom_margin[:] = clearance
            model.pair_margin[:] = clearance
            if not feet:
                _lift_feet(model, self._robot.foot_bodies)
            self._made[clearance, feet] = model
        return self._made[clearance, feet]


_models = once_a_robot(_Models)


class Detector:
    """Finds contacts of poses; the only state is MuJoCo's scratch data.

    Args:
        clearance: Distance below which geoms touch, metres.
        feet: Whether the floor under the feet counts; they stand on it in nearly every frame.
    """

    def __init__(self, robot: Robot, clearance: float, feet: bool = True) -> None:
        self.model, self._clearance = _models(robot).with_margin(clearance, feet), clearance
        self.data = mujoco.MjData(self.model)

    def touches(self, qpos: Float[np.ndarray, "N nq"]) -> Touches:
        """Return all contacts nearer than the clearance."""
        found = _Found([], [], [], [], [])
        for index, row in enumerate(qpos):
            self.data.qpos[:] = row
            mujoco.mj_kinematics(self.model, self.data)
            self._collide(index, found)
        return found.joined(self.model)

    def detect_posed(self, tree: Tree, qpos: Float[np.ndarray, "N nq"]) -> tuple[Posed, Touches]:
        """Return the same, with the forward kinematics that it computes anyway
        (`tree_kinematics.pose`)."""
        data, model, found, count = self.data, self.model, _Found([], [], [], [], []), len(qpos)
        now, sources = data.qpos, (data.xpos, data.xmat, data.xanchor, data.xaxis)
        kept = [np.empty((count, *source.shape)) for source in sources]
        pairs = list(zip(kept, sources, strict=True))
        for index, row in enumerate(qpos):
            now[:] = row
            mujoco.mj_kinematics(model, data)
            for target, source in pairs:
                target[index] = source
            self._collide(index, found)
        body_pos, body_rot, anchor, axis = kept
        body_rot = body_rot.reshape(count, model.nbody, 3, 3)
        return placed(tree, body_pos, body_rot, anchor[:, 1:], axis[:, 1:]), found.joined(model)

    def _collide(self, index: int, found: "_Found") -> None:
        data = self.data
        mujoco.mj_collision(self.model, data)
        if data.ncon:
            contact = data.contact
            near = contact.dist < self._clearance  # the margins of two geoms may add up
            found.frames.append(np.full(near.sum(), index))
            found.distance.append(contact.dist[near])
            found.position.append(contact.pos[near])
            found.normal.append(contact.frame[near, :3])
            found.geoms.append(contact.geom[near])


@dataclass(frozen=True)
class _Found:
    """Contacts of the frames that have some."""

    frames: list[np.ndarray]
    distance: list[np.ndarray]
    position: list[np.ndarray]
    normal: list[np.ndarray]
    geoms: list[np.ndarray]

    def joined(self, model: mujoco.MjModel) -> Touches:
        if not self.frames:
            return _none()
        bodies = model.geom_bodyid[np.concatenate(self.geoms)]
        return Touches(
            frame=np.concatenate(self.frames),
            distance=np.concatenate(self.distance),
            position=np.concatenate(self.position),
            normal=np.concatenate(self.normal),
            bodies=bodies,
            floor=fixed_bodies(model)[bodies].any(axis=1),
        )


def _lift_feet(model: mujoco.MjModel, feet: Int[np.ndarray, " F"]) -> None:
    """Put the floor on a bit of its own that the geoms of the feet do not have."""
    world = fixed_bodies(model)[model.geom_bodyid]
    foot = np.isin(model.geom_bodyid, feet)
    kind, affinity = model.geom_contype, model.geom_conaffinity
    meets = (kind[world][:, None] & affinity) | (kind & affinity[world][:, None])
    floored = (meets != 0).any(axis=0) & ~foot & ~world
    model.geom_contype[world], model.geom_conaffinity[world] = 0, _FLOOR_BIT
    model.geom_contype[floored] |= _FLOOR_BIT
    first, second = model.pair_geom1, model.pair_geom2
    model.pair_margin[(world[first] & foot[second]) | (foot[first] & world[second])] = -_APART_M


def _none() -> Touches:
    return Touches(
        frame=np.zeros(0, int),
        distance=np.zeros(0),
        position=np.zeros((0, 3)),
        normal=np.zeros((0, 3)),
        bodies=np.zeros((0, 2), int),
        floor=np.zeros(0, bool),
    )
