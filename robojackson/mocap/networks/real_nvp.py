"""The invertible networks of NIKI (Li et al., CVPR 2023): affine couplings (Dinh et al. 2017).

A coupling keeps the entries of its mask and changes the others as a function of the kept ones: x' =
m x + (1 - m) (x exp(s(m x)) + t(m x)). Masks alternate 0 1 0 1 ... and 1 0 1 0 .... In NIKI
`inverse` goes from joints to rotations and `forward` back.
"""

from collections.abc import Callable, Sequence

import torch
from jaxtyping import Float
from torch import Tensor, nn

COUPLINGS = 16
HIDDEN = 512
Net = Callable[[Tensor], Tensor]


def alternating(width: int) -> Float[Tensor, "16 D"]:
    """Return the published masks: even couplings keep odd entries, odd ones even entries."""
    first = (torch.arange(width) % 2).float()
    return torch.stack([first, 1.0 - first] * (COUPLINGS // 2))


def to_rotations(
    values: Float[Tensor, "B D"], masks: Tensor, scale: Sequence[Net], shift: Sequence[Net]
) -> Float[Tensor, "B D"]:
    """Apply all couplings in order."""
    for mask, s, t in zip(masks, scale, shift, strict=True):
        kept, free = values * mask, 1.0 - mask
        values = kept + free * (values * torch.exp(s(kept) * free) + t(kept) * free)
    return values


def to_joints(
    values: Float[Tensor, "B D"], masks: Tensor, scale: Sequence[Net], shift: Sequence[Net]
) -> Float[Tensor, "B D"]:
    """Apply the inverse couplings, last first."""
    for mask, s, t in zip(masks.flip(0), scale[::-1], shift[::-1], strict=True):
        kept, free = values * mask, 1.0 - mask
        values = kept + free * (values - t(kept) * free) * torch.exp(-s(kept) * free)
    return values


class RealNvp(nn.Module):
    """Sixteen couplings.

    Args:
        width: Length of a vector.
        dropout: Whether the authors trained with dropout, which shifts the indices of the layers.
    """

    mask: Tensor

    def __init__(self, width: int, dropout: bool) -> None:
        super().__init__()
        self.register_buffer("mask", alternating(width))
        self.t = nn.ModuleList(_layers(width, width, dropout) for _ in range(COUPLINGS))
        self.s = nn.ModuleList(_layers(width, width, dropout) for _ in range(COUPLINGS))

    def inverse(self, values: Float[Tensor, "B D"]) -> Float[Tensor, "B D"]:
        """Return values on the side of the rotations."""
        return to_rotations(values, self.mask, *self._nets())

    def forward(self, values: Float[Tensor, "B D"]) -> Float[Tensor, "B D"]:
        """Return values on the side of the joints."""
        return to_joints(values, self.mask, *self._nets())

    def _nets(self) -> tuple[list[Net], list[Net]]:
        return [_bounded(net) for net in self.s], list(self.t)


class ShapedRealNvp(nn.Module):
    """Sixteen couplings whose nets also get the shape, through a mask that is zero."""

    jts_masks: Tensor
    shape_masks: Tensor

    def __init__(self, width: int, betas: int = 10) -> None:
        super().__init__()
        self.register_buffer("jts_masks", alternating(width))
        self.register_buffer("shape_masks", torch.zeros(COUPLINGS))
        self.jts_nett = nn.ModuleList(_Encoder(width, betas) for _ in range(COUPLINGS))
        self.jts_nets = nn.ModuleList(_Encoder(width, betas) for _ in range(COUPLINGS))

    def inverse(
        self, values: Float[Tensor, "B D"], betas: Float[Tensor, "B 10"]
    ) -> Float[Tensor, "B D"]:
        """Return values on the side of the rotations."""
        return to_rotations(values, self.jts_masks, *self._nets(betas))

    def forward(
        self, values: Float[Tensor, "B D"], betas: Float[Tensor, "B 10"]
    ) -> Float[Tensor, "B D"]:
        """Return values on the side of the joints."""
        return to_joints(values, self.jts_masks, *self._nets(betas))

    def _nets(self, betas: Tensor) -> tuple[list[Net], list[Net]]:
        given = [mask * betas for mask in self.shape_masks]
        scale = [_bounded(_shaped(n, shape)) for n, shape in zip(self.jts_nets, given, strict=True)]
        return scale, [_shaped(n, s) for n, s in zip(self.jts_nett, given, strict=True)]


class _Encoder(nn.Module):
    def __init__(self, width: int, betas: int) -> None:
        super().__init__()
        self.encoder = _layers(width + betas, width, dropout=True)


def _shaped(net: nn.Module, shape: Tensor) -> Net:
    encoder = net.get_submodule("encoder")
    return lambda kept: encoder(torch.cat([kept, shape], 1))


def _bounded(net: Net) -> Net:
    return lambda kept: torch.tanh(net(kept))


def _layers(inputs: int, outputs: int, dropout: bool) -> nn.Sequential:
    """Return three linear layers; identities replace the authors' dropout."""
    gap: tuple[nn.Module, ...] = (nn.Identity(),) if dropout else ()
    return nn.Sequential(
        *(nn.Linear(inputs, HIDDEN), *gap, nn.LeakyReLU()),
        *(nn.Linear(HIDDEN, HIDDEN), *gap, nn.LeakyReLU()),
        nn.Linear(HIDDEN, outputs),
    )
