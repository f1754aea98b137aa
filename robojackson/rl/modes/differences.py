"""What a policy sees of an `onboard` observation that is to hold for motions that it never saw.

Hinge angles and speeds are differences from the next step of the reference, and the reference's own
are left out: by those a policy knows the moment of its motion and learns it by heart. The map is
linear, so that the first layer of a network takes it up: files hold networks of the whole
observation.
"""

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag

ROOT_INPUTS = 9
"""Gyroscope and attitude, at the beginning of the observation."""
OF_A_HINGE = np.array([[-3.0, 0.0], [0.0, -1.0], [3.0, 0.0], [0.0, 1.0]])
"""Angle, speed and those of the reference of a hinge -> both differences, scaled to about one."""


class Differences:
    """The map of an observation, and of the first weights of a network.

    Args:
        hinges, motors: Numbers of them.

    Attributes:
        size: Length of the policy's part of the mapped observation.
    """

    def __init__(self, hinges: int, motors: int) -> None:
        self.size = ROOT_INPUTS + 2 * hinges + motors
        of_hinges = np.kron(OF_A_HINGE, np.eye(hinges))
        self._map = block_diag(np.eye(ROOT_INPUTS), of_hinges, np.eye(motors))

    def of(self, observation: Float[np.ndarray, "N D"]) -> Float[np.ndarray, "N E"]:
        """Return observations as the networks see them; what follows the policy's part stays."""
        whole = len(self._map)
        mapped = observation[:, :whole] @ self._map
        return np.concatenate([mapped, observation[:, whole:]], 1).astype(np.float32)

    def taken_up(self, weight: Float[np.ndarray, "E units"]) -> Float[np.ndarray, "D units"]:
        """Return the first weights of a network for the whole observation."""
        weight = np.asarray(weight, float)
        first = self._map @ weight[: self.size]
        return np.concatenate([first, weight[self.size :]]).astype(np.float32)
