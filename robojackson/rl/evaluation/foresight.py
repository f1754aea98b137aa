"""Whether a robot that leans comes to stand again: its choices are simulated.

Twins of the robots in doubt go on with the programme for a while, without pushes. Those of robots
that would fall try the other choices: to go on from a little further on or back, to step aside
while they go on, to give the part up and stand, and both (a monitor that switches between
controllers by prediction: Sha, IEEE Software, 2001).
"""

from collections.abc import Callable
from functools import partial

import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.rl.config.performance_config import PerformanceConfig
from robojackson.rl.evaluation.performers import Performers, Stage
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.trackers.tracker import Tracker
from robojackson.robot.model import Robot

JUMPS_S = (0.2, -0.2, 0.5, -0.5)
"""How much further on a robot may go on, seconds, in the order in which they are preferred."""
ASIDE_M_S, ASIDE_S, DIRECTIONS = 1.0, 0.5, 8
"""Velocity of a step aside, how long it lasts, and in how many directions it is tried."""
AS_FORESEEN, AGAIN_S = 0.02, 0.5
"""Largest difference between the velocities of a root and of its twin's, each axis, m/s and rad/s,
of a robot that is not simulated again before so many seconds are over."""
Choice = Callable[[Stage, Bool[np.ndarray, " N"]], None]
"""What robots of a stage may do."""


class Foresight:
    """Twins of N robots, in a simulation of their own.

    What is foreseen is exact until something pushes the robot: one that moves as its twin did is
    simulated again only after a while.
    """

    def __init__(self, robot: Robot, tracker: Tracker, config: PerformanceConfig) -> None:
        self._sim = Simulation(robot, tracker.control, config.runs, config.threads)
        self._steps = round(config.ahead_s / self._sim.dt)
        self._foreseen = np.zeros((config.runs, self._steps, 6))
        self._again = min(round(AGAIN_S / self._sim.dt), self._steps // 2)
        self._since = np.full(config.runs, self._steps)
        jumps = [round(seconds / self._sim.dt) for seconds in JUMPS_S]
        leaps = [partial(Stage.jump, steps=steps) for steps in jumps]
        asides = _asides(round(ASIDE_S / self._sim.dt)) if tracker.sees_travel else []
        gives_up = [partial(_one_after_the_other, Stage.give_up, aside) for aside in asides]
        self._choices: list[Choice] = [_go_on, *leaps, *asides, Stage.give_up, *gives_up]

    def choose(
        self, performers: Performers, doubted: Bool[np.ndarray, " N"], passed: int = 1
    ) -> None:
        """Let robots that would fall do what keeps them up longest, the first of what does.

        Args:
            passed: Control steps since the last call.
        """
        self._since += passed
        doubted = doubted & ~self._as_foreseen(performers.sim.qvel[:, :6])
        best, lasts = np.zeros(len(doubted), int), np.where(doubted, -1, self._steps)
        for number, choice in enumerate(self._choices):
            falls: Bool[np.ndarray, " N"] = lasts < self._steps
            if not falls.any():
                break
            now, velocities = self._lasts(performers, falls, choice)
            better = falls & (now > lasts)
            best[better], lasts[better] = number, now[better]
            self._foreseen[better] = velocities[better]
        self._since[doubted] = np.where(lasts[doubted] < self._steps, self._steps, 0)
        for number, choice in enumerate(self._choices):
            choice(performers.stage, best == number)

    def _lasts(
        self, performers: Performers, rows: Bool[np.ndarray, " N"], choice: Choice
    ) -> tuple[Int[np.ndarray, " N"], Float[np.ndarray, "N S 6"]]:
        """Return for how many steps robots stay up after a choice, and the velocities of their
        roots after each."""
        twins, up = performers.copied(self._sim, rows), rows.copy()
        choice(twins.stage, rows)
        lasted, velocities = np.zeros(len(rows), int), np.zeros_like(self._foreseen)
        for step in range(self._steps):
            if not up.any():
                break
            up &= ~twins.step(up).down
            lasted += up
            velocities[:, step] = self._sim.qvel[:, :6]
        return lasted, velocities

    def _as_foreseen(self, velocity: Float[np.ndarray, "N 6"]) -> Bool[np.ndarray, " N"]:
        """Return which robots move as they were foreseen to a moment ago."""
        rows, step = np.arange(len(velocity)), np.clip(self._since - 1, 0, self._steps - 1)
        apart = np.abs(velocity - self._foreseen[rows, step]).max(1)
        result: np.ndarray = (self._since <= self._again) & (apart < AS_FORESEEN)
        return result

    def close(self) -> None:
        """Stop the threads."""
        self._sim.close()


def _go_on(stage: Stage, which: Bool[np.ndarray, " N"]) -> None:
    """Let robots follow the programme as they do."""


def _asides(steps: int) -> list[Choice]:
    """Return steps aside in all directions."""
    angles = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    velocities = ASIDE_M_S * np.stack([np.cos(angles), np.sin(angles)], 1)
    return [partial(Stage.step_aside, velocity=v, steps=steps) for v in velocities]


def _one_after_the_other(
    first: Choice, then: Choice, stage: Stage, which: Bool[np.ndarray, " N"]
) -> None:
    first(stage, which)
    then(stage, which)
