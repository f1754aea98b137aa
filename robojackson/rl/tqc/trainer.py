"""Interface of a trainer: an algorithm that learns on the environment and returns its actor."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from robojackson.rl.tqc.network_arrays import Tensors

if TYPE_CHECKING:
    from stable_baselines3.common.callbacks import BaseCallback

Layers = tuple[tuple[np.ndarray, np.ndarray], ...]


def of_seen(layers: Layers, seen: int | None) -> Layers:
    """Return the layers for the actor's inputs, which are the first of the observation; all when
    None."""
    (weight, bias), *rest = layers
    return ((weight[:seen], bias), *rest)


class Trainer(Protocol):
    """A learning algorithm bound to an environment."""

    def learn(self, callback: "BaseCallback") -> None:
        """Learn until the callback stops it."""

    def layers(self) -> Layers:
        """Return the actor's layers, (weight (in, out), bias) each, the mean's head last."""

    def acting(self) -> tuple[Layers, int]:
        """Return the layers of the actor that the simulations follow now, without waiting for
        updates, and its gradient updates."""

    def steps(self) -> int:
        """Return the control steps so far, over all simulations and resumptions."""

    def updates(self) -> int:
        """Return the gradient updates so far."""

    def networks(self) -> Tensors:
        """Return actor and critics by name (`networks`)."""

    def start_from(self, tensors: Mapping[str, np.ndarray]) -> None:
        """Load named arrays into the networks; act by them from the first step on."""

    def save(self, folder: Path, replay: Path) -> None:
        """Write networks, optimizers, random state, and what is new in the replay buffer."""

    def saved(self) -> None:
        """Remove older files; called when `save`'s files are the checkpoint."""

    def load(self, folder: Path, replay: Path, steps: int, updates: int) -> None:
        """Continue from what `save` wrote."""
