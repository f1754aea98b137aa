"""Positions of a robot's supporting feet, for control laws that follow a motion from there."""

import mujoco
import numpy as np
from jaxtyping import Float, Int

from robojackson.robot.model import Robot

LOW_M = 0.02
"""Height above the lowest foot that reduces a foot's weight by a factor of e, metres."""


class Sites:
    """Sites of a robot in many poses, world frame, metres."""

    def __init__(self, robot: Robot, sites: Int[np.ndarray, " P"]) -> None:
        self._model, self._data, self._sites = robot.model, mujoco.MjData(robot.model), sites

    def at(self, qpos: Float[np.ndarray, "N nq"]) -> Float[np.ndarray, "N P 3"]:
        """Return the sites of robots in poses."""
        found = np.empty((len(qpos), len(self._sites), 3))
        for row, pose in enumerate(qpos):
            self._data.qpos[:] = pose
            mujoco.mj_kinematics(self._model, self._data)
            found[row] = self._data.site_xpos[self._sites]
        return found


def foot_sites(robot: Robot) -> Int[np.ndarray, " F"]:
    """Return the sites of the feet's keypoints."""
    result: np.ndarray = robot.keypoint_sites[np.unique(robot.contact_keypoints)]
    return result


class Feet:
    """The feet's keypoints of a robot, world frame, metres.

    Attributes:
        count: Number of keypoints.
    """

    def __init__(self, robot: Robot) -> None:
        sites = foot_sites(robot)
        self._sites, self.count = Sites(robot, sites), len(sites)

    def places(self, qpos: Float[np.ndarray, "N nq"]) -> Float[np.ndarray, "N F 3"]:
        """Return the feet of robots in poses."""
        return self._sites.at(qpos)

    def apart(
        self, qpos: Float[np.ndarray, "N nq"], places: Float[np.ndarray, "*N F 3"]
    ) -> Float[np.ndarray, "N 2"]:
        """Return the distance of the supporting feet from given places, in the plane of the
        floor."""
        feet = self.places(qpos)
        low = np.exp(-(feet[..., 2] - feet[..., 2].min(-1, keepdims=True)) / LOW_M)
        off = (feet - places)[..., :2]
        result: np.ndarray = (low[..., None] * off).sum(1) / low.sum(1, keepdims=True)
        return result
