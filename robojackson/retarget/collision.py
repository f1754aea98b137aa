"""Touching geoms over a clip, from MuJoCo's own collision detection.

A contact counts from `clearance` above touching, so that the solver stops before it penetrates.
"""

import copy
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.retarget.robot import Robot


@dataclass(frozen=True)
class Touches:
    """Contacts of a clip, one a row.

    Attributes:
        frame: Frame of each.
        distance: Metres, negative where the geoms overlap.
        position: Middle of the contact, metres, world.
        normal: Unit, from the first body to the second.
        bodies: The two bodies.
        floor: Whether the world is one of them.
    """

    frame: Int[np.ndarray, " M"]
    distance: Float[np.ndarray, " M"]
    position: Float[np.ndarray, "M 3"]
    normal: Float[np.ndarray, "M 3"]
    bodies: Int[np.ndarray, "M 2"]
    floor: Bool[np.ndarray, " M"]


class Detector:
    """Finds contacts of poses; the only state is MuJoCo's scratch data."""

    def __init__(self, robot: Robot, clearance: float) -> None:
        self.model = copy.copy(robot.model)
        self.model.geom_margin[:] = clearance
        self.data = mujoco.MjData(self.model)

    def touches(self, qpos: Float[np.ndarray, "N nq"]) -> Touches:
        """All contacts nearer than the clearance."""
        frames, distance, position, normal, geoms = [], [], [], [], []
        data, model = self.data, self.model
        for index, row in enumerate(qpos):
            data.qpos[:] = row
            mujoco.mj_kinematics(model, data)
            mujoco.mj_collision(model, data)
            if data.ncon:
                contact = data.contact
                frames.append(np.full(data.ncon, index))
                distance.append(contact.dist.copy())
                position.append(contact.pos.copy())
                normal.append(contact.frame[:, :3].copy())
                geoms.append(contact.geom.copy())
        if not frames:
            return _none()
        bodies = model.geom_bodyid[np.concatenate(geoms)]
        return Touches(
            frame=np.concatenate(frames),
            distance=np.concatenate(distance),
            position=np.concatenate(position),
            normal=np.concatenate(normal),
            bodies=bodies,
            floor=(bodies == 0).any(axis=1),
        )


def _none() -> Touches:
    return Touches(
        frame=np.zeros(0, int),
        distance=np.zeros(0),
        position=np.zeros((0, 3)),
        normal=np.zeros((0, 3)),
        bodies=np.zeros((0, 2), int),
        floor=np.zeros(0, bool),
    )
