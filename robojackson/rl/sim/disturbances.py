"""Disturbances of a simulated robot in training or evaluation: pushes and sensor noise.

Random numbers follow from the seed and the count of control steps, so that a resumed training
continues with the same ones. World frame, metres, radians, seconds. The sizes are those of mjlab's
tracking task (`tracking_env_cfg`): uniform between plus and minus the numbers below.
"""

from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.rl.config.track_config import RandomConfig

PUSH = (0.5, 0.5, 0.2, 0.52, 0.52, 0.78)
"""Sudden change of the root's velocity: linear, m/s, and angular, rad/s."""
PUSH_EVERY_S = (1.0, 3.0)
HINGE_NOISE, HINGE_SPEED_NOISE = 0.01, 0.5
GYRO_NOISE, ATTITUDE_NOISE, VELOCITY_NOISE = 0.2, 0.05, 0.5


class SeededEach:
    """Random numbers of N robots, each from a seed of its own."""

    def __init__(self, seeds: Sequence[int], purpose: int, count: int) -> None:
        self._rngs = [np.random.default_rng([seed, purpose, count]) for seed in seeds]

    def uniform(self, low: float, high: float, size: int | tuple[int, ...]) -> np.ndarray:
        """Return what every generator gives; the first axis is that of the robots."""
        rest = () if isinstance(size, int) else size[1:]
        return np.array([rng.uniform(low, high, rest) for rng in self._rngs])

    def standard_normal(self, size: tuple[int, ...]) -> np.ndarray:
        """Return what every generator gives; the first axis is that of the robots."""
        return np.array([rng.standard_normal(size[1:]) for rng in self._rngs])


class Disturbances:
    """Pushes and sensor noise of N robots.

    Args:
        seed: Seed of all robots together, or one of every robot.

    Attributes:
        count: Control steps so far, (1,).
        push_at: Control step of each robot's next push.
    """

    def __init__(self, config: RandomConfig, n: int, dt: float, seed: int | Sequence[int]) -> None:
        self._dt, self._seed, self._n = dt, seed, n
        share = config.shares(n)[:, None]
        self._noise, self._pushes = share * config.sensor_noise, share * config.pushes
        self.count = np.zeros(1, int)
        self.push_at = self._waits(self._rng(0))

    def restart(self, seed: int) -> None:
        """Begin with the random numbers of a seed, at no control step."""
        self._seed, self.count[:] = seed, 0
        self.push_at[:] = self._waits(self._rng(0))

    def sense(
        self, qpos: Float[np.ndarray, "N nq"], qvel: Float[np.ndarray, "N nv"]
    ) -> tuple[Float[np.ndarray, "N nq"], Float[np.ndarray, "N nv"]]:
        """Return the states as noisy sensors measure them; constant within a control step."""
        if not self._noise.any():
            return qpos, qvel
        rng = self._rng(1)
        qpos, qvel = qpos.copy(), qvel.copy()
        place, speed = qpos[:, 7:], qvel[:, 6:]
        place += self._noise * HINGE_NOISE * rng.uniform(-1, 1, place.shape)
        speed += self._noise * HINGE_SPEED_NOISE * rng.uniform(-1, 1, speed.shape)
        widths = np.repeat([VELOCITY_NOISE, GYRO_NOISE], 3)
        qvel[:, :6] += self._noise * widths * rng.uniform(-1, 1, (self._n, 6))
        turns = self._noise * ATTITUDE_NOISE * rng.uniform(-1, 1, (self._n, 3))
        for i, turn in enumerate(turns):
            mujoco.mju_quatIntegrate(qpos[i, 3:7], turn, 1.0)
        return qpos, qvel

    def accelerometer_noise(self) -> Float[np.ndarray, "N 3"]:
        """Return noise of this control step, normally distributed, in standard deviations."""
        return self._rng(3).standard_normal((self._n, 3))

    def after_step(self, datas: Sequence[mujoco.MjData], active: Bool[np.ndarray, " N"]) -> None:
        """Count a control step and push the robots whose push is due."""
        self.count += 1
        if not self._pushes.any():
            return
        due = self.push_at <= self.count[0]
        if not due.any():
            return
        rng = self._rng(2)
        kicks = self._pushes * rng.uniform(-1, 1, (self._n, 6)) * PUSH
        for i in np.flatnonzero(due & active):
            datas[int(i)].qvel[:6] += kicks[i]
        self.push_at[due] = (self.count[0] + self._waits(rng))[due]

    def _waits(self, rng: np.random.Generator | SeededEach) -> Int[np.ndarray, " N"]:
        found: np.ndarray = np.round(rng.uniform(*PUSH_EVERY_S, self._n) / self._dt).astype(int)
        return found

    def _rng(self, purpose: int) -> np.random.Generator | SeededEach:
        if not isinstance(self._seed, int):
            return SeededEach(self._seed, purpose, int(self.count[0]))
        return np.random.default_rng([self._seed, purpose, int(self.count[0])])
