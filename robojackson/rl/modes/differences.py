"""What a policy sees of an `onboard` observation that is to hold for motions that it never saw.

Hinge angles and speeds are differences from the next step of the reference, and the reference's own
are left out: by those a policy knows the moment of its motion and learns it by heart. The critics
of a training, which have to know the motion to tell what is left of it to win, see them after
everything else. The maps are linear, so that the first layer of a network takes them up: files hold
networks of the whole observation.
"""

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag

ROOT_INPUTS = 9
"""Gyroscope and attitude, at the beginning of the observation."""
OF_A_HINGE = np.array([[-3.0, 0.0], [0.0, -1.0], [3.0, 0.0], [0.0, 1.0]])
"""Angle, speed and those of the reference of a hinge -> both differences, scaled to about one."""
REFERENCE_OF_A_HINGE = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
"""The same -> those of the reference."""


class Differences:
    """The map of an observation, and of the first weights of a network.

    Args:
        hinges, motors: Numbers of them.
        rest: Length of what the critics alone see.

    Attributes:
        size: Length of the policy's part of the mapped observation.
        whole: Length of the mapped observation.
    """

    def __init__(self, hinges: int, motors: int, rest: int) -> None:
        each, nothing = np.eye(hinges), np.zeros((motors, 0))
        of_hinges = np.kron(OF_A_HINGE, each)
        self._map = block_diag(np.eye(ROOT_INPUTS), of_hinges, np.eye(motors))
        reference = np.kron(REFERENCE_OF_A_HINGE, each)
        self._reference = block_diag(np.zeros((ROOT_INPUTS, 0)), reference, nothing)
        self.size, self._rest = self._map.shape[1], rest
        self.whole = self.size + rest + self._reference.shape[1]

    def of(self, observation: Float[np.ndarray, "N D"]) -> Float[np.ndarray, "N E"]:
        """Return observations as the networks see them: the policy's part, what follows it, and the
        reference's angles and speeds."""
        seen = observation[:, : len(self._map)]
        parts = [seen @ self._map, observation[:, len(self._map) :], seen @ self._reference]
        return np.concatenate(parts, 1).astype(np.float32)

    def taken_up(self, weight: Float[np.ndarray, "E units"]) -> Float[np.ndarray, "D units"]:
        """Return the first weights of a network for the whole observation: of a policy, or of a
        critic, whose last inputs, the actions, stay."""
        weight = np.asarray(weight, float)
        first = self._map @ weight[: self.size]
        rest, end = self.size + self._rest, self.whole
        if len(weight) > self.size:
            first += self._reference @ weight[rest:end]
        parts = [first, weight[self.size : rest], weight[end:]]
        return np.concatenate(parts).astype(np.float32)
