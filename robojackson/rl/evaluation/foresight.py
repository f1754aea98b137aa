"""Whether a robot that leans comes to stand again: its choices are simulated.

Twins of the robots in doubt go on with the programme for a while, without pushes. Those of robots
that would fall try the other choices: to go on from a little further on or back, and to give the
part up and stand (a monitor that switches between controllers by prediction: Sha, IEEE Software,
2001).
"""

from functools import partial

import numpy as np
from jaxtyping import Bool, Int

from robojackson.rl.config.performance_config import PerformanceConfig
from robojackson.rl.evaluation.performers import Performers, Stage
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.trackers.tracker import Tracker
from robojackson.robot.model import Robot

JUMPS_S = (0.2, -0.2, 0.5, -0.5)
"""How much further on a robot may go on, seconds, in the order in which they are preferred."""


class Foresight:
    """Twins of N robots, in a simulation of their own."""

    def __init__(self, robot: Robot, tracker: Tracker, config: PerformanceConfig) -> None:
        self._sim = Simulation(robot, tracker.control, config.runs, config.threads)
        self._steps = round(config.ahead_s / self._sim.dt)
        jumps = [round(seconds / self._sim.dt) for seconds in JUMPS_S]
        self._choices = [partial(Stage.jump, steps=steps) for steps in jumps] + [Stage.give_up]

    def choose(self, performers: Performers, doubted: Bool[np.ndarray, " N"]) -> None:
        """Let robots that would fall do what keeps them up longest, the first of what does."""
        nobody = np.zeros_like(doubted)
        lasts = self._lasts(performers, doubted, partial(Stage.give_up, which=nobody))
        best: Int[np.ndarray, " N"] = np.full(len(doubted), -1)
        for number, choice in enumerate(self._choices):
            falls: Bool[np.ndarray, " N"] = doubted & (lasts < self._steps)
            if not falls.any():
                break
            now = self._lasts(performers, falls, partial(choice, which=falls))
            best = np.where(falls & (now > lasts), number, best)
            lasts = np.where(falls, np.maximum(now, lasts), lasts)
        for number, choice in enumerate(self._choices):
            choice(performers.stage, which=best == number)

    def _lasts(
        self, performers: Performers, rows: Bool[np.ndarray, " N"], choice: partial[None]
    ) -> Int[np.ndarray, " N"]:
        """Return for how many steps robots stay up after a choice."""
        twins, up = performers.copied(self._sim, rows), rows.copy()
        choice(twins.stage)
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
