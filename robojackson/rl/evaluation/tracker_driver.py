"""A tracker as the driver of an evaluation, with a window of the reference and a memory."""

import numpy as np

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.evaluation.rollouts import Driver
from robojackson.rl.sim.accelerometer import Accelerometer
from robojackson.rl.sim.reference_clip import Clip, ClipStep
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.trackers.tracker import Follower, Tracker, TrackerInput
from robojackson.robot.model import Robot


def tracker_driver(tracker: Tracker, robot: Robot, reference: ReferenceMotion) -> Driver:
    """Return the driver of a tracker on one reference motion.

    Args:
        robot: The robot that `Tracker.equip` returned.

    Raises:
        BadPolicy: the tracker is for another robot.
    """
    return Driver(tracker.control, _Command(tracker, robot, reference))


class _Command:
    """`Driver.command` of a tracker; a new simulation begins with an empty memory."""

    def __init__(self, tracker: Tracker, robot: Robot, reference: ReferenceMotion) -> None:
        self._tracker, self._robot, self._clip = tracker, robot, Clip(reference)
        self._sim: Simulation | None = None
        self._accelerometer: Accelerometer | None = None
        self._follower: Follower = tracker.follow(robot, 0)

    def __call__(
        self, sim: Simulation, following: ClipStep, start: np.ndarray, last: np.ndarray
    ) -> np.ndarray:
        if self._accelerometer is None or sim is not self._sim:
            self._sim, self._follower = sim, self._tracker.follow(self._robot, sim.n)
            self._accelerometer = Accelerometer(sim, self._robot.description.imu)
        ahead = tuple(
            following if k == 1 else self._clip.at(following.step + k - 1)
            for k in self._tracker.window
        )
        force = self._accelerometer.read()
        return self._follower.targets(TrackerInput(*sim.sensed(), sim.points, ahead, force))
