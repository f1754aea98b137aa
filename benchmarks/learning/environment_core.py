"""The environment beside a bare `mj_step` loop, which gets the controls that the environment wrote
and the states that it put fallen robots into: both are in the same state at every substep, to the
bit. Their turns alternate on one core; CPU time of the thread.

    python -m benchmarks.learning.environment_core g1 20     # robot, repeats
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.rl.config.train_config import TqcConfig, TrackConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.modes.standing_motion import make_standing_motion
from robojackson.robot.model import Robot, load_robot

BLOCK = 10
"""Control steps of one turn."""


def named(robot: str) -> Robot:
    """Return a robot of `configs/robots`.

    Raises:
        BadConfiguration: its model is not here.
    """
    return load_robot(describe_robot(robot))


def humanoid() -> Robot:
    """Return the stock robot."""
    return named("humanoid")


@dataclass(frozen=True)
class Script:
    """The commands of an environment to MuJoCo, control step by control step.

    Attributes:
        controls: Controls of every batch of robots, (substeps, robots, nu).
        placed: (robot, qpos, qvel) that were put somewhere after the step; first, before it.
    """

    controls: list[list[np.ndarray]]
    placed: list[list[tuple[int, np.ndarray, np.ndarray]]]


@dataclass(frozen=True)
class Speeds:
    """Substeps a CPU second: medians over the repeats, and medians of their ratios.

    Attributes:
        ours, bare, batched: The environment, the plain loop, the one in the order of our batches.
        ratio, ratio_batched: Ours over either.
    """

    ours: float
    bare: float
    batched: float
    ratio: float
    ratio_batched: float


def core(repeats: int, steps: int = 60, robot: Robot | None = None) -> Speeds:
    """Time the environment beside both loops, turn by turn.

    Args:
        robot: The stock one when None.
    """
    robot, n = robot or humanoid(), TqcConfig().n_envs
    script = recorded(_core(robot, n), steps)
    rates = [_turns(robot, script, n, steps) for _ in range(repeats)]
    found = [float(np.median(column)) for column in zip(*rates, strict=True)]
    ratios = [float(np.median([rate[0] / rate[i] for rate in rates])) for i in (1, 2)]
    return Speeds(*found, *ratios)


def _turns(robot: Robot, script: Script, n: int, steps: int) -> tuple[float, float, float]:
    """Return the substeps a CPU second of the environment, of the plain loop and of the batched
    one."""
    environment = _core(robot, n)
    loops = [Bare(robot.model, n, script, batched) for batched in (False, True)]
    environment.reset()
    spent = np.zeros(3)
    for first in range(0, steps, BLOCK):
        count = min(BLOCK, steps - first)
        spent += [_timed(environment, count), *(loop.run(first, count) for loop in loops)]
    for loop in loops:
        assert np.array_equal(environment.sim.qpos, [data.qpos for data in loop.datas])
    substeps = n * steps * (environment.sim.control.substeps or 1)
    ours, bare, batched = substeps / spent
    return float(ours), float(bare), float(batched)


def _core(robot: Robot, n: int) -> TrackingCore:
    return TrackingCore(robot, make_standing_motion(robot), TrackConfig(threads=1), n, 0)


def _action(core: TrackingCore) -> np.ndarray:
    return np.zeros((core.n, core.action_size))


def _timed(core: TrackingCore, steps: int) -> float:
    action = _action(core)
    began = time.thread_time()
    for _ in range(steps):
        core.step(action)
    return time.thread_time() - began


def recorded(core: TrackingCore, steps: int) -> Script:
    """Run an environment and record its commands to MuJoCo."""
    script, place = Script([], [[]]), core.sim.place
    batches = [_Spy(batch.controls) for _, _, batch in core.sim.chunks[0]]
    for (_, _, batch), spy in zip(core.sim.chunks[0], batches, strict=True):
        batch.controls = spy  # type: ignore[method-assign]

    def spy_place(indices: np.ndarray, qpos: np.ndarray, qvel: np.ndarray) -> None:
        script.placed[-1].extend(zip(map(int, indices), qpos.copy(), qvel.copy(), strict=True))
        place(indices, qpos, qvel)

    core.sim.place = spy_place  # type: ignore[method-assign]
    core.reset()
    for _ in range(steps):
        script.placed.append([])
        core.step(_action(core))
        script.controls.append([spy.taken() for spy in batches])
    return script


class _Spy:
    """The controls of a batch, written down."""

    def __init__(self, controls: Callable[[np.ndarray], np.ndarray]) -> None:
        self._controls, self._wrote = controls, list[np.ndarray]()

    def __call__(self, targets: np.ndarray) -> np.ndarray:
        commands = self._controls(targets)
        self._wrote.append(commands.copy())
        return commands

    def taken(self) -> np.ndarray:
        """Return what was written since the last call."""
        wrote, self._wrote = np.array(self._wrote), []
        return wrote


class Bare:
    """A loop over `mj_step` that follows a script.

    Args:
        batched: Speed in the environment's order, a batch at a time, which the cache of
            the processor likes; else substep by substep over all robots, as a plain loop does.
    """

    def __init__(self, model: mujoco.MjModel, n: int, script: Script, batched: bool) -> None:
        self.datas = [mujoco.MjData(model) for _ in range(n)]
        self._model, self._placed = model, script.placed
        robots = [(data, data.ctrl) for data in self.datas]
        ends = np.cumsum([batch.shape[1] for batch in script.controls[0]])
        split = np.split(np.arange(n), ends[:-1]) if batched else [np.arange(n)]
        self._robots = [[robots[i] for i in which] for which in split]
        merged = lambda commands: [np.concatenate(commands, 1)]  # noqa: E731
        self._controls = (
            script.controls if batched else [merged(t) for t in script.controls]  # type: ignore[no-untyped-call]
        )
        self._place(0)

    def run(self, first: int, steps: int) -> float:
        """Return CPU seconds of some control steps; putting robots elsewhere is not counted."""
        spent, model, step = 0.0, self._model, mujoco.mj_step
        for t in range(first, first + steps):
            began = time.thread_time()
            for robots, commands in zip(self._robots, self._controls[t], strict=True):
                for controls in commands:
                    for (data, ctrl), control in zip(robots, controls, strict=True):
                        ctrl[:] = control
                        step(model, data)
            spent += time.thread_time() - began
            self._place(t + 1)
        return spent

    def _place(self, t: int) -> None:
        for i, qpos, qvel in self._placed[t]:
            data = self.datas[i]
            mujoco.mj_resetData(self._model, data)
            data.qpos[:], data.qvel[:] = qpos, qvel
            mujoco.mj_forward(self._model, data)


if __name__ == "__main__":
    print(core(int(sys.argv[2]), robot=named(sys.argv[1])))
