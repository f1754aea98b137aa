"""What a trainer is: an algorithm that learns on the environment and hands out its actor."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from robojackson.rl.tqc.network_arrays import Tensors

if TYPE_CHECKING:
    from stable_baselines3.common.callbacks import BaseCallback

Layers = tuple[tuple[np.ndarray, np.ndarray], ...]


def of_seen(layers: Layers, seen: int | None) -> Layers:
    """The layers for the inputs that the actor sees: the first of them; all when None."""
    (weight, bias), *rest = layers
    return ((weight[:seen], bias), *rest)


class Trainer(Protocol):
    """A learning algorithm bound to an environment."""

    def learn(self, callback: "BaseCallback") -> None:
        """Learn until the callback says stop."""

    def layers(self) -> Layers:
        """The actor's layers, (weight (in, out), bias) each, the mean's head last."""

    def acting(self) -> tuple[Layers, int]:
        """The same of the actor that the simulations follow now, without waiting for updates, and
        the gradient updates that it has had."""

    def steps(self) -> int:
        """Control steps so far, over all simulations and resumptions."""

    def updates(self) -> int:
        """Gradient updates so far."""

    def networks(self) -> Tensors:
        """Actor and critics by name (`networks`)."""

    def start_from(self, tensors: Mapping[str, np.ndarray]) -> None:
        """Put named arrays in the place of the networks; act by them from the first step on."""

    def save(self, folder: Path, replay: Path) -> None:
        """Write networks, optimizers, random state, and what is new in the replay buffer."""

    def saved(self) -> None:
        """Called when what `save` wrote is the checkpoint: what is older may go."""

    def load(self, folder: Path, replay: Path, steps: int, updates: int) -> None:
        """Continue from what `save` wrote."""
