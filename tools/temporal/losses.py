"""Losses of the lifter: place, velocity, speed, spread of joints, tilt of up, contacts of feet."""

import torch
from torch import nn

from robojackson.motion.smpl_sequence import AIR, PLANTED
from tools.temporal.batches import TWELVE, Batch
from tools.temporal.net import Found
from tools.temporal.tensors import index_on, numbers_on

LEAST_STEP_M = 0.003
"""Step of a joint that stands still, metres a frame: what is slower has no speed to keep."""


def losses_of(found: Found, batch: Batch) -> tuple[dict[str, torch.Tensor], torch.Tensor]:
    """Return the losses by name, and the errors of the joints (B, L, 12, 3), metres.

    Place: mean distance of joints, m. Velocity: of their steps, m a frame. Speed: log ratio of the
    mean speeds of window and truth, without which uncertain depth makes limbs slow. Spread, tilt:
    Laplace likelihoods. Contact: cross-entropy.
    """
    twelve = index_on(batch.good.device, *TWELVE)
    body, flat = batch.truth[:, :, twelve], batch.flat[:, :, twelve]
    good, distance = batch.good, batch.distance[..., None]
    z = batch.local[:, :, twelve, 2] + found.correction[..., 2]
    across = flat * ((distance + z) / distance)[..., None] + found.correction[..., :2]
    place = torch.cat([across, z[..., None]], -1)
    error = place - body
    both = good[:, 1:] * good[:, :-1]
    off = torch.stack([_length(error[..., :2]) / 2.0, error[..., 2].abs()], -1).detach()
    spread = (found.log_spread + off * torch.exp(-found.log_spread)).sum(-1)
    losses = {
        "place": _mean(_length(error), good),
        "velocity": _mean(_length(error[:, 1:] - error[:, :-1]), both),
        "speed": (_log_speed(place, both) - _log_speed(body, both)).abs().mean(),
        "spread": _mean(spread, good),
        "tilt": tilt_loss(found, batch),
        "contact": contact_loss(found.contact, batch),
    }
    return losses, error


def tilt_loss(found: Found, batch: Batch) -> torch.Tensor:
    """Return the negative log likelihood of the roll and pitch of up, means of each window."""
    up, good = batch.up, batch.good
    share = good[..., None] / good.sum(1).clamp(min=1.0)[:, None, None]
    true = nn.functional.normalize((up * share).sum(1), dim=-1)
    mean = nn.functional.normalize((found.up * share).sum(1), dim=-1)
    across = nn.functional.normalize(
        torch.linalg.cross(true, numbers_on(up.device, 0.0, 0.0, 1.0).expand_as(true))
    )
    off = torch.stack(
        [(mean * across).sum(-1), (mean * torch.linalg.cross(true, across)).sum(-1)], -1
    ).abs()
    size = (found.log_tilt * share).sum(1)
    return (off * torch.exp(-size) + size).sum(-1).mean()


def contact_loss(contact: torch.Tensor, batch: Batch) -> torch.Tensor:
    """Return the cross-entropy of touching and planted foot points, nats."""
    labels = torch.stack([batch.contact != AIR, batch.contact == PLANTED], -1).float()
    nats = nn.functional.binary_cross_entropy_with_logits(contact, labels, reduction="none")
    return _mean(nats.flatten(2), batch.good)


def _log_speed(place: torch.Tensor, both: torch.Tensor) -> torch.Tensor:
    """Return the logarithm of each joint's mean step in each window (B, 12); m a frame."""
    steps = _length(place[:, 1:] - place[:, :-1]) * both[..., None]
    return torch.log(steps.sum(1) / both.sum(1).clamp(min=1.0)[:, None] + LEAST_STEP_M)


def _length(x: torch.Tensor) -> torch.Tensor:
    return torch.sqrt((x**2).sum(-1) + 1e-8)


def _mean(values: torch.Tensor, good: torch.Tensor) -> torch.Tensor:
    return (values * good[..., None]).sum() / good.sum().clamp(min=1.0) / values.shape[-1]
