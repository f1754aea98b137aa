"""A path for a regulator, and the system along it. Metres, radians, seconds."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

Progress = Callable[[str, int, int], None]
"""Called with the name of the computation, finished steps, and all."""


@dataclass(frozen=True)
class Gains:
    """A regulator: targets = those of the reference - gain @ (state - nominal) - offset.

    Attributes:
        gain: Gain at every step of the reference.
        offset: Offset of the targets, rad.
        qpos, qvel: Nominal state.
        places: Feet of the nominal state, which is moved along the floor to the robot's own feet.
            NaN where the nominal state stays in the world.
        held: Share of noisy starts from which it brings robots to the end by the strict rule,
            without a policy, one number for each motion; NaN where that was not tried.
    """

    gain: Float[np.ndarray, "S nu X"]
    offset: Float[np.ndarray, "S nu"]
    qpos: Float[np.ndarray, "S nq"]
    qvel: Float[np.ndarray, "S nv"]
    places: Float[np.ndarray, "S F 3"]
    held: Float[np.ndarray, " M"] = field(default_factory=lambda: np.full(1, np.nan))


@dataclass(frozen=True)
class Path:
    """Nominal states, and the targets of the motors on the way to the next."""

    qpos: Float[np.ndarray, "T nq"]
    qvel: Float[np.ndarray, "T nv"]
    targets: Float[np.ndarray, "T nu"]

    def __len__(self) -> int:
        return len(self.qpos)


@dataclass(frozen=True)
class Linear:
    """The system along a path.

    Attributes:
        by_state, by_target: Derivatives of the next state.
        defect: Difference of the next state from the path's, mean over the disturbances.
    """

    by_state: Float[np.ndarray, "T X X"]
    by_target: Float[np.ndarray, "T X nu"]
    defect: Float[np.ndarray, "T X"]


@dataclass(frozen=True)
class Pull:
    """Half the slopes of a cost beside the quadratic one, at a path: a path that is off its motion
    is pulled towards it.

    Attributes:
        state: By the state.
        target: By the offset of the targets.
    """

    state: Float[np.ndarray, "T X"]
    target: Float[np.ndarray, "T nu"]


@dataclass(frozen=True)
class Recursion:
    """Result of the Riccati recursion: the feedback and the cost of the rest of the motion.

    The cost of a state that is x off the path is x @ value @ x + 2 slope @ x and a constant.
    """

    gain: Float[np.ndarray, "T nu X"]
    offset: Float[np.ndarray, "T nu"]
    value: Float[np.ndarray, "T X X"]
    slope: Float[np.ndarray, "T X"]


def no_progress(name: str, step: int, total: int) -> None:
    """Do nothing."""
