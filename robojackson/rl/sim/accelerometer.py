"""The accelerometer of simulated robots. World frame, metres, seconds, unless noted."""

from collections.abc import Sequence
from typing import Protocol

import mujoco
import numpy as np
from jaxtyping import Float, Int

from robojackson.geometry.rotations import quat_to_matrix

NOISE_M_S2 = 0.1
"""Standard deviation of what it shows, m/s^2: several times that of a robot's inertial sensor."""


class Moving(Protocol):
    """Robots that carry accelerometers: the states of a `Simulation`."""

    model: mujoco.MjModel
    dt: float
    qpos: Float[np.ndarray, "N nq"]
    qvel: Float[np.ndarray, "N nv"]


class Accelerometer:
    """Specific force at the accelerometers of N robots, noise included; read it once every control
    step.

    Args:
        place: Of the accelerometer in the frame of the root, m.

    Attributes:
        velocity: Of the accelerometers at the last reading, world, m/s.
    """

    def __init__(
        self, sim: Moving, place: Sequence[float] = (0.0, 0.0, 0.0), seed: int = 0
    ) -> None:
        self._sim, self._place, self._rng = sim, np.array(place), np.random.default_rng(seed)
        self.velocity = self._measure()

    def begin(self, rows: Int[np.ndarray, " I"]) -> None:
        """Forget what some robots did before."""
        self.velocity[rows] = self._measure()[rows]

    def read(self, noise: Float[np.ndarray, "N 3"] | None = None) -> Float[np.ndarray, "N 3"]:
        """Return the mean since the last reading, or since the beginning, in the frames of the
        roots, m/s^2; the opposite of gravity for a robot at rest.

        Args:
            noise: In units of `NOISE_M_S2`; its own, normally distributed, when None.
        """
        sim, before = self._sim, self.velocity
        self.velocity = self._measure()
        change = (self.velocity - before) / sim.dt - sim.model.opt.gravity
        force = np.einsum("nji,nj->ni", quat_to_matrix(sim.qpos[:, 3:7]), change)
        shaken = self._rng.standard_normal(force.shape) if noise is None else noise
        result: np.ndarray = force + NOISE_M_S2 * shaken
        return result

    def _measure(self) -> Float[np.ndarray, "N 3"]:
        """Return the velocities of the accelerometers, world."""
        swing = swing_velocity(self._sim.qpos, self._sim.qvel, self._place)
        velocity: np.ndarray = self._sim.qvel[:, :3] + swing
        return velocity


def swing_velocity(
    qpos: Float[np.ndarray, "N nq"], qvel: Float[np.ndarray, "N nv"], place: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "N 3"]:
    """Return the velocities of a point of the root beside its origin, world, m/s.

    Args:
        place: Of the point in the frame of the root, m.
    """
    spin = np.cross(qvel[:, 3:6], place)
    result: np.ndarray = np.einsum("nij,nj->ni", quat_to_matrix(qpos[:, 3:7]), spin)
    return result
