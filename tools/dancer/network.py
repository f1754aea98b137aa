"""The dancer's networks: an actor that a policy file holds, and the critic of its training.

The actor has the layers of `rl.policy`: ReLU between them, tanh at the end; its normalisation of
the observations is folded into the first layer when it is saved.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np
import torch
from torch import nn

FIRST_DEVIATION = 0.25
"""Standard deviation of the first actions, full actions."""
LEAST_DEVIATION = 1e-2
"""Added to the deviation of an observation."""
CONSTANT = 1e-4
"""Deviation of an observation that was the same in training, as a hidden phase: it has no part."""
HIDDEN = (1024, 512, 256)


class Scale(nn.Module):
    """Mean and deviation of all observations so far; subtracted and divided by."""

    def __init__(self, size: int) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(size))
        self.register_buffer("variance", torch.ones(size))
        self.register_buffer("count", torch.tensor(1e-2))

    def forward(self, seen: torch.Tensor) -> torch.Tensor:
        """Return the scaled observations."""
        return (seen - self.mean) / (self.variance.sqrt() + LEAST_DEVIATION)

    def learn(self, seen: torch.Tensor) -> None:
        """Take observations into account (Chan's formula)."""
        count, total = len(seen), self.count + len(seen)
        mean, variance = seen.mean(0), seen.var(0, unbiased=False)
        apart = mean - self.mean
        both = self.variance * self.count + variance * count + apart**2 * self.count * count / total
        self.mean += apart * count / total
        self.variance.copy_(both / total)
        self.count.copy_(total)


def network(inputs: int, hidden: tuple[int, ...], outputs: int, last: float) -> nn.Sequential:
    """Return layers with ReLU between; `last` scales the last one's first weights."""
    layers: list[nn.Module] = []
    for wide, narrow in pairwise((inputs, *hidden)):
        layers += [nn.Linear(wide, narrow), nn.ReLU()]
    final = nn.Linear(hidden[-1], outputs)
    with torch.no_grad():
        final.weight *= last
        final.bias *= 0.0
    return nn.Sequential(*layers, final)


class Dancer(nn.Module):
    """Actor and critic."""

    def __init__(
        self, actor_size: int, size: int, motors: int, hidden: tuple[int, ...] = HIDDEN
    ) -> None:
        super().__init__()
        self.actor_size = actor_size
        self.scale = Scale(size)
        self.actor = network(actor_size, hidden, motors, 0.01)
        self.critic = network(size, hidden, 1, 1.0)
        self.log_deviation = nn.Parameter(torch.full((motors,), float(np.log(FIRST_DEVIATION))))

    def act(self, seen: torch.Tensor) -> torch.Tensor:
        """Return the mean actions, -1..1, of scaled observations (N, D)."""
        return torch.tanh(self.actor(seen[:, : self.actor_size]))

    def value(self, seen: torch.Tensor) -> torch.Tensor:
        """Return the values of scaled observations, (N,)."""
        return self.critic(seen)[:, 0]

    def layers(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return (weight (in, out), bias) of the actor's layers for observations as they are."""
        linear = [layer for layer in self.actor if isinstance(layer, nn.Linear)]
        found = [(_array(one.weight).T, _array(one.bias)) for one in linear]
        size = self.actor_size
        mean = _array(self.scale.mean)[:size]
        deviation = np.sqrt(_array(self.scale.variance)[:size]) + LEAST_DEVIATION
        weight, bias = found[0]
        weight = weight / deviation[:, None]
        weight[deviation < CONSTANT + LEAST_DEVIATION] = 0.0
        found[0] = (weight, bias - mean @ weight)
        return [(weight.astype(np.float32), bias.astype(np.float32)) for weight, bias in found]


def _array(tensor: torch.Tensor) -> np.ndarray:
    """Return a tensor on the processor, in double precision."""
    return np.asarray(tensor.detach().double().cpu())


def save(dancer: nn.Module, path: Path, steps: int) -> None:
    """Write the networks, weights in half precision, and the control steps of their training."""
    arrays = {name: tensor.cpu().numpy() for name, tensor in dancer.state_dict().items()}
    halves = {name: array.astype(np.float16) if array.ndim == 2 else array
              for name, array in arrays.items()}  # fmt: skip
    part = path.with_suffix(".part.npz")
    np.savez(part, steps=np.array(steps), **halves)
    part.replace(path)


def hidden_of(path: Path) -> tuple[int, ...]:
    """Return the widths of the hidden layers of networks that `save` wrote."""
    with np.load(path) as arrays:
        actor = [one for one in arrays.files if one.startswith("actor.") and one.endswith("weight")]
        return tuple(len(arrays[one]) for one in actor[:-1])


def restore(dancer: Dancer, path: Path) -> int:
    """Read networks that `save` wrote; return the control steps of their training."""
    with np.load(path) as arrays:
        state = {name: torch.as_tensor(np.asarray(arrays[name], np.float32))
                 for name in arrays.files if name != "steps"}  # fmt: skip
        steps = int(arrays["steps"])
    dancer.load_state_dict(state)
    return steps
