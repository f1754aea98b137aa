"""The state of simulated robots as they know it themselves, from one control step to the next.

World frame, metres, radians, seconds.
"""

import numpy as np
from jaxtyping import Float, Int

from robojackson.rl.sim.accelerometer import Accelerometer, Moving
from robojackson.rl.sim.leg_odometry import LegOdometry, RootState
from robojackson.robot.model import Robot

PARTS = ("place", "velocity", "imu_velocity")


class RootEstimate:
    """Sensors of N robots, and what leg odometry makes of them.

    A robot's odometry begins when it is placed. Within a control step the estimate is computed
    once.

    Attributes:
        noise: Of the accelerometers, multiples of `accelerometer.NOISE_M_S2`.
    """

    noise = 1.0

    def __init__(self, robot: Robot, sim: Moving, n: int) -> None:
        self._accelerometer = Accelerometer(sim, robot.description.imu)
        self._odometry = LegOdometry(robot, sim.dt)
        self._begins, self._current = np.ones(n, bool), np.zeros(n, bool)
        self._estimate = np.zeros((n, robot.model.nq)), np.zeros((n, robot.model.nv))

    def begin(self, rows: Int[np.ndarray, " I"]) -> None:
        """Forget what some robots did before: they have been placed."""
        self._accelerometer.begin(rows)
        self._begins[rows], self._current[rows] = True, False

    def after_step(self) -> None:
        """Read the sensors again at the next request."""
        self._current[:] = False

    def of(
        self,
        qpos: Float[np.ndarray, "N nq"],
        qvel: Float[np.ndarray, "N nv"],
        path: tuple[Float[np.ndarray, "N nq"], Float[np.ndarray, "N nv"]],
        noise: Float[np.ndarray, "N 3"],
    ) -> tuple[Float[np.ndarray, "N nq"], Float[np.ndarray, "N nv"]]:
        """Return the states with the estimates of the root's place and velocity.

        Args:
            qpos, qvel: As the sensors measure them; place and velocity of the root are not read.
            path: States that the feedback keeps the robots in, now.
            noise: Of the accelerometers (`Accelerometer.read`).
        """
        stale = ~self._current
        if stale.any():
            before = self._odometry.now
            force = None if before is None else self._accelerometer.read(self.noise * noise)
            found = self._odometry.estimate(qpos, qvel, force, path, self._begins)
            qpos, qvel = (
                np.where(stale[:, None], new, old)
                for new, old in zip(found, self._estimate, strict=True)
            )
            self._estimate = qpos, qvel
            self._keep(before, stale)
            self._begins[:], self._current[:] = False, True
        return self._estimate

    def state(self) -> dict[str, np.ndarray]:
        """Return the memory between two control steps, as arrays."""
        now = self._odometry.now
        size = (len(self._begins), 3)
        parts = {part: np.zeros(size) if now is None else getattr(now, part) for part in PARTS}
        felt = {"felt": self._accelerometer.velocity, "begins": self._begins}
        return {f"root_{name}": array.copy() for name, array in (parts | felt).items()}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Restore the memory from `state`."""
        self._odometry.now = RootState(*(np.array(state[f"root_{part}"]) for part in PARTS))
        self._accelerometer.velocity = np.array(state["root_felt"])
        self._begins = np.array(state["root_begins"])
        self._current[:] = False

    def _keep(self, before: RootState | None, stale: np.ndarray) -> None:
        """Restore the memory of robots whose estimate is of this control step already."""
        now = self._odometry.now
        if before is None or now is None or stale.all():
            return
        parts = ((getattr(now, part), getattr(before, part)) for part in PARTS)
        self._odometry.now = RootState(*(np.where(stale[:, None], new, old) for new, old in parts))
