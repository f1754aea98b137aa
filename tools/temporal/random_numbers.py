"""Random numbers on any device, the same for the same seeds."""

from collections.abc import Sequence

import numpy as np
import torch


class RandomNumbers:
    """Draws tensors on a device."""

    def __init__(self, seeds: Sequence[int], device: torch.device | str = "cpu") -> None:
        """Begin the sequence that belongs to some seeds."""
        self.device = torch.device(device)
        self._generator = torch.Generator(self.device)
        state = np.random.SeedSequence(list(seeds)).generate_state(2)
        self._generator.manual_seed(int(state[0]) << 31 ^ int(state[1]))

    def uniform(self, low: float, high: float, *shape: int) -> torch.Tensor:
        """Return numbers between two limits."""
        drawn = torch.rand(shape, generator=self._generator, device=self.device)
        return low + (high - low) * drawn

    def log_uniform(self, low: float, high: float, *shape: int) -> torch.Tensor:
        """Return numbers between two limits whose logarithms are uniform."""
        return torch.exp(self.uniform(float(np.log(low)), float(np.log(high)), *shape))

    def normal(self, *shape: int) -> torch.Tensor:
        """Return normal numbers of unit size."""
        return torch.randn(shape, generator=self._generator, device=self.device)

    def integers(self, high: int, *shape: int) -> torch.Tensor:
        """Return integers from zero on, under `high`."""
        return torch.randint(high, shape, generator=self._generator, device=self.device)

    def chance(self, probability: float, *shape: int) -> torch.Tensor:
        """Return true as often as the probability says."""
        return self.uniform(0.0, 1.0, *shape) < probability

    def choice(self, weights: Sequence[float], count: int) -> torch.Tensor:
        """Return indices, each as often as its weight says."""
        chances = torch.tensor(weights, device=self.device)
        return torch.multinomial(chances, count, replacement=True, generator=self._generator)
