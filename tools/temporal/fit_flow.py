"""Fitting the flow on the lifter's errors, with NIKI's losses (Li et al., CVPR 2023).

Inverse: the error's z is likely under an AR(1) process of standard normals. Forward: z = 0 is the
lifter's own answer. Boundary: a clean clip has z = 0. Independence: z carries nothing of the pose
(maximum mean discrepancy between (pose, z) and (pose, noise)).
"""

from collections.abc import Callable
from dataclasses import replace

import torch

from tools.temporal.batches import TWELVE, Batch
from tools.temporal.fit import FitConfig, Source
from tools.temporal.losses import losses_of
from tools.temporal.net import Flow, Lifter
from tools.temporal.random_numbers import RandomNumbers

WEIGHTS = {"inverse": 1.0, "forward": 1.0, "boundary": 0.1, "independence": 1.0}
BANDWIDTHS = (0.05, 0.2, 0.9)
"""Of the discrepancy's kernels, in shares of the mean squared distance."""
SAMPLE = 128


def fit_flow(
    lifter: Lifter,
    pairs: Source,
    steps: int,
    seed: int,
    watch: Callable[[int, dict[str, float]], None],
) -> Flow:
    """Return a flow for a trained lifter, which stays as it is; fitted to the real pairs alone, on
    their device."""
    torch.manual_seed(seed)
    lifter.eval().to(pairs.device)
    flow = Flow(lifter.enter.out_features).to(pairs.device)
    optimiser = torch.optim.Adam(flow.parameters(), lr=1e-3)
    config = FitConfig(batch=24)
    for step in range(steps):
        rng = RandomNumbers([seed, 3, step], pairs.device)
        losses = flow_losses(flow, lifter, pairs.draw(config, 0.0, rng), rng)
        total = torch.stack([WEIGHTS[name] * value for name, value in losses.items()]).sum()
        optimiser.zero_grad()
        total.backward()
        torch.nn.utils.clip_grad_norm_(flow.parameters(), 1.0)
        optimiser.step()
        if (step + 1) % 50 == 0:
            watch(step + 1, {name: float(value.detach()) for name, value in losses.items()})
    lifter.cpu()
    return flow.cpu()


def flow_losses(
    flow: Flow, lifter: Lifter, batch: Batch, rng: RandomNumbers
) -> dict[str, torch.Tensor]:
    """Return the four losses."""
    good, body = batch.good, batch.truth[:, :, TWELVE]
    error, h = _errors(lifter, batch)
    z, volume = flow(error, h)
    clean_z, _ = flow(*_errors(lifter, cleaned(batch)))
    return {
        "inverse": -(_log_likelihood(flow, z, good) + (volume * good).sum() / good.sum()) / 36.0,
        "forward": (flow.inverse(torch.zeros_like(error), h) ** 2).mean(),
        "boundary": (clean_z**2).mean(),
        "independence": independence(body[good > 0], z[good > 0], rng),
    }


def cleaned(batch: Batch) -> Batch:
    """Return the windows as a perfect detector would see the person."""
    away = batch.distance[..., None, None]
    flat = batch.truth[..., :2] * away / (away + batch.truth[..., 2:])
    seen = torch.ones_like(batch.visibility)
    return replace(batch, flat=flat, local=batch.truth, visibility=seen)


def independence(body: torch.Tensor, z: torch.Tensor, rng: RandomNumbers) -> torch.Tensor:
    """Return the discrepancy between pose with z and pose with noise, on some frames."""
    chosen, other = (rng.normal(len(z)).argsort()[:SAMPLE] for _ in range(2))
    pose = body[chosen].flatten(1)
    pose = pose / (pose.std() + 1e-6)
    noise = rng.normal(len(other), z.shape[-1])
    elsewhere = body[other].flatten(1)
    elsewhere = elsewhere / (elsewhere.std() + 1e-6)
    return discrepancy(torch.cat([pose, z[chosen]], 1), torch.cat([elsewhere, noise], 1))


def discrepancy(x: torch.Tensor, y: torch.Tensor) -> torch.Tensor:
    """Return the maximum mean discrepancy with inverse multiquadric kernels (Gretton et al.
    2012)."""
    joined = torch.cat([x, y])
    squares = torch.cdist(joined, joined) ** 2
    size = squares.mean().detach()
    kernel = torch.stack([s * size / (s * size + squares) for s in BANDWIDTHS]).sum(0)
    n = len(x)
    return kernel[:n, :n].mean() + kernel[n:, n:].mean() - 2.0 * kernel[:n, n:].mean()


def _errors(lifter: Lifter, batch: Batch) -> tuple[torch.Tensor, torch.Tensor]:
    """Return the error over spread (B, T, 36), and features."""
    with torch.no_grad():
        h = lifter.features(batch.numbers())
        found = lifter.head(h)
        error = -losses_of(found, batch)[1]
        scaled = error * torch.exp(-found.log_spread[..., [0, 0, 1]])
    return scaled.flatten(2).clamp(-6.0, 6.0), h


def _log_likelihood(flow: Flow, z: torch.Tensor, good: torch.Tensor) -> torch.Tensor:
    """Return the log-likelihood of a course of z under the AR(1) prior, nats a frame."""
    memory = torch.sigmoid(flow.memory)
    fresh = 1.0 - memory**2
    step = z[:, 1:] - memory * z[:, :-1]
    later = -0.5 * (step**2 / fresh + torch.log(fresh)).sum(-1)
    first = -0.5 * (z[:, :1] ** 2).sum(-1)
    together = torch.cat([first, later], 1)
    return (together * good).sum() / good.sum()
