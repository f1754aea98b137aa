"""Fitting the lifter: place, velocity and spread of twelve joints, on real and invented pairs."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import nn

from robojackson.metrics import pose_error
from robojackson.mocap.landmarks.blazepose import BODY
from robojackson.mocap.temporal import features
from robojackson.mocap.temporal.temporal_lift import corrected
from tools.temporal.batches import TWELVE, Batch, change, joined, table, windows
from tools.temporal.depth_errors import Change
from tools.temporal.examples import Example
from tools.temporal.filming import film, with_constants
from tools.temporal.invented import Detector
from tools.temporal.net import Lifter
from tools.temporal.truths import Bank


@dataclass(frozen=True)
class FitConfig:
    """Configuration of fitting the lifter.

    Attributes:
        steps: Steps of the optimiser.
        batch: Windows a step.
        rate: Learning rate, warmed up over 100 steps, then a cosine.
        decay: Weight decay.
        invented: Share of windows of the invented detector, at the first and the last step.
        velocity, spread: Weights of these losses beside that of the place.
        average: Memory of the running mean of the weights, which is what is kept.
        change: Change of the windows.
    """

    steps: int = 6000
    batch: int = 32
    rate: float = 1.5e-3
    decay: float = 0.02
    invented: tuple[float, float] = (0.85, 0.75)
    velocity: float = 3.0
    spread: float = 0.01
    average: float = 0.997
    change: Change = field(default_factory=Change)


@dataclass
class Progress:
    """State that a run needs to resume."""

    step: int
    net: Lifter
    mean: dict[str, torch.Tensor]
    optimiser: torch.optim.Optimizer
    curve: list[dict[str, float]]


@dataclass(frozen=True)
class Source:
    """Source of batches."""

    real: Batch
    bank: Bank | None
    detector: Detector

    def draw(self, config: FitConfig, share: float, rng: np.random.Generator) -> Batch:
        """Return a batch, changed."""
        frames, count = config.change.frames, config.batch
        made = round(count * share) if self.bank else 0
        rows = rng.integers(0, len(self.real.good), count - made)
        batch = windows(self.real, rows, frames, rng)
        if self.bank and made:
            rows = rng.integers(0, len(self.bank), made)
            sizes = rng.choice(self.detector.sizes, made)
            filmed = film(self.bank, rows, frames, sizes, rng)
            batch = joined(batch, with_constants(self.detector.see(filmed, rng)))
        return change(batch, config.change, rng)


def source(examples: Sequence[Example], bank: Bank | None) -> Source:
    """Return the tables of the real pairs and the simulated detector of the bank."""
    real = table(examples)
    return Source(real, bank, Detector(real, examples))


def begin(examples: Sequence[Example], config: FitConfig, seed: int) -> Progress:
    """Return a fresh network, its input normalised by the examples."""
    torch.manual_seed(seed)
    net = Lifter()
    numbers = np.concatenate([features.numbers(e.sight)[::10] for e in examples])
    net.mean.copy_(torch.from_numpy(numbers.mean(0)))
    net.scale.copy_(torch.from_numpy(1.0 / (numbers.std(0) + 0.02)))
    optimiser = torch.optim.AdamW(net.parameters(), lr=config.rate, weight_decay=config.decay)
    mean = {name: value.clone() for name, value in net.state_dict().items()}
    return Progress(0, net, mean, optimiser, [])


def fit(
    progress: Progress,
    pairs: Source,
    config: FitConfig,
    seed: int,
    watch: Callable[[Progress, float], None],
) -> None:
    """Train from where `progress` stands; `watch` gets it and CPU seconds a step now and then."""
    began, first = time.process_time(), progress.step
    losses: list[tuple[float, ...]] = []
    for step in range(progress.step, config.steps):
        rng = np.random.default_rng([seed, 2, step])
        share = float(np.interp(step, [0, config.steps], config.invented))
        for group in progress.optimiser.param_groups:
            group["lr"] = config.rate * _schedule(step, config.steps)
        losses.append(_learn(progress, pairs.draw(config, share, rng), config))
        progress.step = step + 1
        if progress.step % 100 == 0 or progress.step == config.steps:
            names = ("place", "velocity", "spread")
            means = dict(zip(names, np.mean(losses, 0).tolist(), strict=True))
            progress.curve.append({"step": progress.step, **means})
            losses = []
            watch(progress, (time.process_time() - began) / (progress.step - first))


def losses_of(
    correction: torch.Tensor, log_spread: torch.Tensor, batch: Batch
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor]:
    """Return the mean distance of joints (m), of their steps (m a frame), likelihood of the spread;
    errors."""
    flat, body, good = (torch.from_numpy(np.ascontiguousarray(v, np.float32)) for v in (
        batch.flat[:, :, TWELVE], batch.truth[:, :, TWELVE], batch.good))  # fmt: skip
    depth = torch.from_numpy(np.ascontiguousarray(batch.local[:, :, TWELVE, 2], np.float32))
    distance = torch.from_numpy(batch.distance.astype(np.float32))[..., None]
    z = depth + correction[..., 2]
    across = flat * ((distance + z) / distance)[..., None] + correction[..., :2]
    error = torch.cat([across, z[..., None]], -1) - body
    both = good[:, 1:] * good[:, :-1]
    place = _mean(_length(error), good)
    velocity = _mean(_length(error[:, 1:] - error[:, :-1]), both)
    off = torch.stack([_length(error[..., :2]) / 2.0, error[..., 2].abs()], -1).detach()
    spread = _mean((log_spread + off * torch.exp(-log_spread)).sum(-1), good)
    return place, velocity, spread, error


def validate(net: Lifter, examples: Sequence[Example]) -> dict[str, float]:
    """Return PA-MPJPE and root-relative MPJPE of detector and network on examples, mm, mean of
    clips."""
    net.eval()
    rows = []
    for example in examples:
        sight, good = example.sight, example.good
        body = example.truth[:, BODY].astype(float)
        with torch.no_grad():
            numbers = torch.from_numpy(features.numbers(sight)[None].astype(np.float32))
            correction = net(numbers)[0][0].numpy()
        before, after = features.base(sight)[good], corrected(sight, correction)[good]
        rows.append(
            [
                f(x, body[good])
                for f in (pose_error.pa_mpjpe, pose_error.mpjpe)
                for x in (before, after)
            ]
        )
    net.train()
    names = ("pa_detector", "pa_network", "rr_detector", "rr_network")
    return dict(zip(names, (1e3 * np.mean(rows, 0)).tolist(), strict=True))


def averaged(progress: Progress) -> Lifter:
    """Return the network with the running mean of its weights."""
    net = Lifter()
    net.load_state_dict(progress.mean)
    return net


def _learn(progress: Progress, batch: Batch, config: FitConfig) -> tuple[float, float, float]:
    correction, log_spread = progress.net(torch.from_numpy(batch.numbers()))
    place, velocity, spread, _ = losses_of(correction, log_spread, batch)
    loss = 10.0 * (place + config.velocity * velocity + config.spread * spread)
    progress.optimiser.zero_grad()
    loss.backward()
    nn.utils.clip_grad_norm_(progress.net.parameters(), 1.0)
    progress.optimiser.step()
    memory = min(config.average, progress.step / (progress.step + 10.0))
    for name, value in progress.net.state_dict().items():
        progress.mean[name].lerp_(value, 1.0 - memory)
    return place.item(), velocity.item(), spread.item()


def _schedule(step: int, steps: int) -> float:
    return float(min(1.0, (step + 1) / 100.0) * (0.5 * (1.0 + np.cos(np.pi * step / steps)) + 0.01))


def _length(x: torch.Tensor) -> torch.Tensor:
    return torch.sqrt((x**2).sum(-1) + 1e-8)


def _mean(values: torch.Tensor, good: torch.Tensor) -> torch.Tensor:
    return (values * good[..., None]).sum() / good.sum().clamp(min=1.0) / values.shape[-1]
