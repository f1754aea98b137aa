"""The accelerometer of simulated robots. World frame, metres, seconds, unless noted."""

import numpy as np
from jaxtyping import Float

from robojackson.geometry.rotations import quat_to_matrix
from robojackson.rl.sim.simulation import Simulation

NOISE_M_S2 = 0.1
"""Standard deviation of what it shows, m/s^2: several times that of a robot's inertial sensor."""


class Accelerometer:
    """Specific force at the roots of N robots, noise included; read it once every control step."""

    def __init__(self, sim: Simulation, seed: int = 0) -> None:
        self._sim, self._rng = sim, np.random.default_rng(seed)
        self._velocity = sim.qvel[:, :3].copy()

    def read(self) -> Float[np.ndarray, "N 3"]:
        """Return the mean since the last reading, or since the beginning, in the frames of the
        roots, m/s^2; the opposite of gravity for a robot at rest."""
        sim = self._sim
        change = (sim.qvel[:, :3] - self._velocity) / sim.dt - sim.model.opt.gravity
        self._velocity = sim.qvel[:, :3].copy()
        force = np.einsum("nji,nj->ni", quat_to_matrix(sim.qpos[:, 3:7]), change)
        result: np.ndarray = force + NOISE_M_S2 * self._rng.standard_normal(force.shape)
        return result
