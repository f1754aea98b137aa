"""The temporal network and its flow in torch, to be trained; what runs is their numpy twin,
`robojackson.mocap.temporal`.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import torch
from torch import nn

from robojackson.mocap.temporal import error_flow, features
from robojackson.mocap.temporal.features import COUNT, ClipView
from robojackson.mocap.temporal.temporal_network import (
    GROUND,
    LOG_SPREAD,
    LOG_TILT,
    SPREAD_RANGE,
    UPRIGHT,
    block_count,
    dilation_of,
)

WIDTH, BLOCKS = 160, 4
"""Default channels and residual blocks of a lifter."""
JOINTS, FEET = 12, 4
OUT = JOINTS * 5
"""Correction (3), log spread across the image and in depth (2)."""


class Found(NamedTuple):
    """Output of the network.

    Attributes:
        correction: Of the detector's positions (B, T, 12, 3), metres.
        log_spread: Across the image and in depth (B, T, 12, 2).
        contact: Log odds that heels and toes touch, and that they are planted (B, T, 4, 2): a
            second task of the training, which the weights file does not keep.
        up: Direction against gravity in each frame (B, T, 3), not of unit length.
        log_tilt: Log of the mean absolute error of its roll and pitch (B, T, 2), radians.
    """

    correction: torch.Tensor
    log_spread: torch.Tensor
    contact: torch.Tensor
    up: torch.Tensor
    log_tilt: torch.Tensor


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
        normal, count, d = self.norm(x).to(x.dtype), x.shape[1], self.dilation
        first, last = normal[:, :1].expand(-1, d, -1), normal[:, -1:].expand(-1, d, -1)
        held = torch.cat([first, normal, last], 1)
        taps = [held[:, k * d : k * d + count] for k in range(3)]
        inner = torch.relu(self.spread(torch.cat(taps, -1)))
        return x + self.dropout(self.mix(inner))


class Lifter(nn.Module):
    """The temporal convolution."""

    mean: torch.Tensor
    scale: torch.Tensor

    def __init__(self, width: int = WIDTH, blocks: int = BLOCKS, dropout: float = 0.05) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(COUNT))
        self.register_buffer("scale", torch.ones(COUNT))
        self.enter = nn.Linear(COUNT, width)
        self.blocks = nn.ModuleList(
            Block(width, dilation_of(number), dropout) for number in range(blocks)
        )
        self.leave = nn.Linear(width, OUT)
        nn.init.normal_(self.leave.weight, std=1e-3)
        nn.init.zeros_(self.leave.bias)
        self.ground, self.feet = nn.Linear(width, GROUND), nn.Linear(width, 2 * FEET)
        for last in (self.ground, self.feet):
            nn.init.normal_(last.weight, std=1e-3)
            nn.init.zeros_(last.bias)

    def features(self, x: torch.Tensor) -> torch.Tensor:
        """Return the input (B, T, COUNT) to what the last layer and the flow read, (B, T, C)."""
        h = self.enter((x - self.mean) * self.scale)
        for block in self.blocks:
            h = block(h)
        return h

    def head(self, h: torch.Tensor) -> Found:
        """Return what the last layers read from the features."""
        out, ground = self.leave(h).unflatten(-1, (JOINTS, 5)), self.ground(h)
        log_spread = out[..., 3:].clamp(-SPREAD_RANGE, SPREAD_RANGE) + LOG_SPREAD
        contact = self.feet(h).unflatten(-1, (FEET, 2))
        up = ground[..., :3] + ground.new_tensor(UPRIGHT)
        log_tilt = ground[..., 3:].clamp(-SPREAD_RANGE, SPREAD_RANGE) + LOG_TILT
        return Found(out[..., :3], log_spread, contact, up, log_tilt)

    def forward(self, x: torch.Tensor) -> Found:
        """Return what the network finds in a clip."""
        return self.head(self.features(x))


def lifter_of(arrays: Mapping[str, torch.Tensor]) -> Lifter:
    """Return a fresh lifter of the size of a state."""
    return Lifter(len(arrays["enter.bias"]), block_count(arrays))


def found_in(net: Lifter, sight: ClipView) -> Found:
    """Return what a network finds in a clip, without gradients and the axis of the batch."""
    numbers = torch.from_numpy(features.numbers(sight)[None].astype(np.float32))
    with torch.no_grad():
        return Found(*(part[0] for part in net(numbers)))


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
