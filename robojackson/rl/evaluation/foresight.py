"""Whether a robot that leans comes to stand again: its choices are simulated.

Twins of the robots in doubt go on with the programme for a while, without pushes. Those of robots
that would fall try the other choices: to go on from a little further on or back, and to give the
part up and stand (a monitor that switches between controllers by prediction: Sha, IEEE Software,
2001).
"""

from collections.abc import Callable
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
Choice = Callable[[Stage, Bool[np.ndarray, " N"]], None]
"""What robots of a stage may do."""


class Foresight:
    """Twins of N robots, in a simulation of their own."""

    def __init__(self, robot: Robot, tracker: Tracker, config: PerformanceConfig) -> None:
        self._sim = Simulation(robot, tracker.control, config.runs, config.threads)
        self._steps = round(config.ahead_s / self._sim.dt)
        jumps = [round(seconds / self._sim.dt) for seconds in JUMPS_S]
        leaps = [partial(Stage.jump, steps=steps) for steps in jumps]
        self._choices: list[Choice] = [_go_on, *leaps, Stage.give_up]

    def choose(self, performers: Performers, doubted: Bool[np.ndarray, " N"]) -> None:
        """Let robots that would fall do what keeps them up longest, the first of what does."""
        best, lasts = np.zeros(len(doubted), int), np.where(doubted, -1, self._steps)
        for number, choice in enumerate(self._choices):
            falls: Bool[np.ndarray, " N"] = lasts < self._steps
            if not falls.any():
                break
            now = self._lasts(performers, falls, choice)
            better = falls & (now > lasts)
            best[better], lasts[better] = number, now[better]
        for number, choice in enumerate(self._choices):
            choice(performers.stage, best == number)

    def _lasts(
        self, performers: Performers, rows: Bool[np.ndarray, " N"], choice: Choice
    ) -> Int[np.ndarray, " N"]:
        """Return for how many steps robots stay up after a choice."""
        twins, up = performers.copied(self._sim, rows), rows.copy()
        choice(twins.stage, rows)
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


def _go_on(stage: Stage, which: Bool[np.ndarray, " N"]) -> None:
    """Let robots follow the programme as they do."""
