"""Whether a robot that leans comes to stand again: both of its choices are simulated.

Twins of the robots in doubt go on with the programme for a while, without pushes; twins of those
that would fall give up their part. A robot gives up where its twin that stands stays up longer (a
monitor that switches between two controllers by prediction: Sha, IEEE Software, 2001).
"""

import numpy as np
from jaxtyping import Bool, Int

from robojackson.rl.config.performance_config import PerformanceConfig
from robojackson.rl.evaluation.performers import Performers
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.trackers.tracker import Tracker
from robojackson.robot.model import Robot


class Foresight:
    """Twins of N robots, in a simulation of their own."""

    def __init__(self, robot: Robot, tracker: Tracker, config: PerformanceConfig) -> None:
        self._sim = Simulation(robot, tracker.control, config.runs, config.threads)
        self._steps = round(config.ahead_s / self._sim.dt)

    def lost(
        self, performers: Performers, doubted: Bool[np.ndarray, " N"]
    ) -> Bool[np.ndarray, " N"]:
        """Return which robots fall if they go on and not, or later, if they give up."""
        going_on = self._lasts(performers, doubted, np.zeros_like(doubted))
        falls: Bool[np.ndarray, " N"] = doubted & (going_on < self._steps)
        if not falls.any():
            return falls
        return falls & (self._lasts(performers, falls, falls) > going_on)

    def _lasts(
        self,
        performers: Performers,
        rows: Bool[np.ndarray, " N"],
        giving_up: Bool[np.ndarray, " N"],
    ) -> Int[np.ndarray, " N"]:
        """Return for how many steps robots stay up."""
        twins, up = performers.copied(self._sim, rows), rows.copy()
        twins.stage.give_up(giving_up)
        lasted = np.zeros(len(rows), int)
        for _ in range(self._steps):
            if not up.any():
                break
            up &= ~twins.step(up).down
            lasted += up
        return lasted

    def close(self) -> None:
        """Stop the threads."""
        self._sim.close()
