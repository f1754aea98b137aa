"""The temporal network and its flow in torch, to be trained; what runs is their numpy twin,
`robojackson.mocap.temporal`.
"""

import torch
from torch import nn

from robojackson.mocap.temporal import error_flow
from robojackson.mocap.temporal.features import COUNT
from robojackson.mocap.temporal.temporal_network import DILATIONS, LOG_SPREAD, SPREAD_RANGE

WIDTH = 160
JOINTS = 12
OUT = JOINTS * 5
"""Correction (3), log spread across the image and in depth (2)."""


class Block(nn.Module):
    """Normalise, look at three frames so far apart (the ends held), mix, add."""

    def __init__(self, width: int, dilation: int, dropout: float) -> None:
        super().__init__()
        self.dilation = dilation
        self.norm = nn.LayerNorm(width)
        self.spread = nn.Linear(3 * width, width)
        self.mix = nn.Linear(width, width)
        self.dropout = nn.Dropout(dropout)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return (B, T, C) to the same."""
        normal, count, d = self.norm(x), x.shape[1], self.dilation
        first, last = normal[:, :1].expand(-1, d, -1), normal[:, -1:].expand(-1, d, -1)
        held = torch.cat([first, normal, last], 1)
        taps = [held[:, k * d : k * d + count] for k in range(3)]
        inner = torch.relu(self.spread(torch.cat(taps, -1)))
        return x + self.dropout(self.mix(inner))


class Lifter(nn.Module):
    """The temporal convolution."""

    mean: torch.Tensor
    scale: torch.Tensor

    def __init__(self, width: int = WIDTH, dropout: float = 0.05) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(COUNT))
        self.register_buffer("scale", torch.ones(COUNT))
        self.enter = nn.Linear(COUNT, width)
        self.blocks = nn.ModuleList(Block(width, d, dropout) for d in DILATIONS)
        self.leave = nn.Linear(width, OUT)
        nn.init.normal_(self.leave.weight, std=1e-3)
        nn.init.zeros_(self.leave.bias)

    def features(self, x: torch.Tensor) -> torch.Tensor:
        """Return the input (B, T, COUNT) to what the last layer and the flow read, (B, T, C)."""
        h = self.enter((x - self.mean) * self.scale)
        for block in self.blocks:
            h = block(h)
        return h

    def head(self, h: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the correction (B, T, 12, 3) and log spread (B, T, 12, 2)."""
        out = self.leave(h).unflatten(-1, (JOINTS, 5))
        return out[..., :3], out[..., 3:].clamp(-SPREAD_RANGE, SPREAD_RANGE) + LOG_SPREAD

    def forward(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the correction and log spread of a clip."""
        return self.head(self.features(x))


class Flow(nn.Module):
    """RealNVP between error over spread and z, conditioned on the lifter's features."""

    def __init__(self, width: int = WIDTH) -> None:
        super().__init__()
        self.memory = nn.Parameter(torch.full((error_flow.SIZE,), 2.0))
        self.read = nn.Linear(width, error_flow.CONDITION)
        self.couplings = nn.ModuleList(_coupling() for _ in range(error_flow.LAYERS))

    def forward(self, x: torch.Tensor, h: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the error to z, and the logarithm of the volume change."""
        condition = torch.relu(self.read(h))
        volume = x.new_zeros(x.shape[:-1])
        for layer in range(error_flow.LAYERS):
            kept, scale, shift = self._nets(x, condition, layer)
            x = x * kept + (1 - kept) * (x * torch.exp(scale) + shift)
            volume = volume + ((1 - kept) * scale).sum(-1)
        return x, volume

    def inverse(self, z: torch.Tensor, h: torch.Tensor) -> torch.Tensor:
        """Return z to error."""
        condition = torch.relu(self.read(h))
        for layer in reversed(range(error_flow.LAYERS)):
            kept, scale, shift = self._nets(z, condition, layer)
            z = z * kept + (1 - kept) * (z - shift) * torch.exp(-scale)
        return z

    def _nets(
        self, x: torch.Tensor, condition: torch.Tensor, layer: int
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        kept = torch.from_numpy(error_flow.mask_of(layer)).to(x)
        out = self.couplings[layer](torch.cat([x * kept, condition], -1))
        return kept, 1.5 * torch.tanh(out[..., : error_flow.SIZE]), out[..., error_flow.SIZE :]


def _coupling() -> nn.Sequential:
    """Log scale and shift of one layer, nothing at first."""
    last = nn.Linear(error_flow.HIDDEN, 2 * error_flow.SIZE)
    nn.init.normal_(last.weight, std=1e-3)
    nn.init.zeros_(last.bias)
    first = nn.Linear(error_flow.SIZE + error_flow.CONDITION, error_flow.HIDDEN)
    return nn.Sequential(first, nn.ReLU(), last)
