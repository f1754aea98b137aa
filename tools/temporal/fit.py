"""Fitting the lifter: place, velocity and spread of twelve joints, on real and invented pairs."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import nn

from robojackson.body.forward_kinematics import unit
from robojackson.metrics import pose_error
from robojackson.mocap.landmarks.blazepose import BODY
from robojackson.mocap.temporal import features
from robojackson.mocap.temporal.temporal_lift import corrected
from robojackson.motion.smpl_sequence import PLANTED
from tools.temporal.batches import Batch, change, joined, table, windows
from tools.temporal.depth_errors import Change
from tools.temporal.examples import Example
from tools.temporal.filming import film, with_constants
from tools.temporal.invented import Detector, sizes_of
from tools.temporal.losses import losses_of
from tools.temporal.net import BLOCKS, WIDTH, Lifter, found_in, lifter_of
from tools.temporal.random_numbers import RandomNumbers
from tools.temporal.truths import Bank

LOSSES = ("place", "velocity", "speed", "spread", "tilt", "contact")
VALIDATED = (
    "pa_detector", "pa_network", "rr_detector", "rr_network", "speed_ratio", "tilt_deg",
    "planted_f1",
)  # fmt: skip


@dataclass(frozen=True)
class FitConfig:
    """Configuration of fitting the lifter.

    Attributes:
        width, blocks: Channels and residual blocks of the network.
        steps: Steps of the optimiser.
        batch: Windows a step.
        rate: Learning rate, warmed up over `warm_up` steps, then a cosine.
        warm_up: Steps.
        decay: Weight decay.
        invented: Share of windows of the invented detector, at the first and the last step.
        velocity, speed, spread, tilt, contact: Weights of these losses beside that of the place.
        average: Memory of the running mean of the weights, which is what is kept.
        change: Change of the windows.
    """

    width: int = WIDTH
    blocks: int = BLOCKS
    steps: int = 20000
    batch: int = 32
    rate: float = 1.5e-3
    warm_up: int = 100
    decay: float = 0.02
    invented: tuple[float, float] = (0.5, 0.35)
    velocity: float = 3.0
    speed: float = 0.02
    spread: float = 0.01
    tilt: float = 0.01
    contact: float = 0.02
    average: float = 0.999
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

    @property
    def device(self) -> torch.device:
        """Return where the batches are drawn."""
        return self.real.good.device

    def draw(self, config: FitConfig, share: float, rng: RandomNumbers) -> Batch:
        """Return a batch, changed."""
        frames, count = config.change.frames, config.batch
        made = round(count * share) if self.bank else 0
        rows = rng.integers(len(self.real.good), count - made)
        batch = windows(self.real, rows, frames, rng)
        if self.bank and made:
            rows = rng.integers(len(self.bank), made)
            sizes = self.detector.sizes[rng.integers(len(self.detector.sizes), made)]
            filmed = film(self.bank, rows, frames, sizes, rng)
            batch = joined(batch, with_constants(self.detector.see(filmed, rng)))
        return change(batch, config.change, rng)


def source(examples: Sequence[Example], bank: Bank | None, device: str = "cpu") -> Source:
    """Return the tables of the real pairs and the simulated detector of the bank, on a device."""
    real = table(examples).on(device)
    return Source(real, bank and bank.on(device), Detector(real, sizes_of(examples)))


def begin(
    examples: Sequence[Example], config: FitConfig, seed: int, device: str = "cpu"
) -> Progress:
    """Return a fresh network on a device, its input normalised by the examples."""
    torch.manual_seed(seed)
    net = Lifter(config.width, config.blocks)
    numbers = np.concatenate([features.numbers(e.sight)[::10] for e in examples])
    net.mean.copy_(torch.from_numpy(numbers.mean(0)))
    net.scale.copy_(torch.from_numpy(1.0 / (numbers.std(0) + 0.02)))
    net.mean[-3:], net.scale[-3:] = 0.0, 1.0  # zero where up is not known
    net.to(device)
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
    """Train from where `progress` stands; `watch` gets it and seconds a step now and then."""
    began, first = time.monotonic(), progress.step
    losses: list[torch.Tensor] = []
    while progress.step < config.steps:
        rng = RandomNumbers([seed, 2, progress.step], pairs.device)
        share = float(np.interp(progress.step, [0, config.steps], config.invented))
        losses.append(learn(progress, pairs.draw(config, share, rng), config))
        if progress.step % 100 == 0 or progress.step == config.steps:
            means = dict(zip(LOSSES, torch.stack(losses).mean(0).tolist(), strict=True))
            progress.curve.append({"step": progress.step, **means})
            losses = []
            watch(progress, (time.monotonic() - began) / (progress.step - first))


def validate(net: Lifter, examples: Sequence[Example]) -> dict[str, float]:
    """Return means over clips of `VALIDATED`: PA-MPJPE and root-relative MPJPE of detector and
    network, mm, the network's ratio of speeds, error of gravity, degrees, and planted F1."""
    net.eval()
    rows = []
    for example in examples:
        sight, good = example.sight, example.good
        body = example.truth[:, BODY].astype(float)
        found = found_in(net, sight)
        after = corrected(sight, found.correction.numpy())[good]
        before, right = features.base(sight)[good], body[good]
        errors = [
            1e3 * f(x, right) for f in (pose_error.pa_mpjpe, pose_error.mpjpe)
            for x in (before, after)
        ]  # fmt: skip
        speeds = [np.linalg.norm(np.diff(x, axis=0), axis=-1).mean() for x in (after, right)]
        up, true = (unit(x[good].mean(0)) for x in (found.up.numpy(), example.up))
        tilt = np.degrees(np.arccos(np.clip(up @ true, -1.0, 1.0)))
        planted = (found.contact[..., 1].numpy() > 0.0)[good]
        stands = (example.contact == PLANTED)[good]
        total = max(planted.sum() + stands.sum(), 1)
        f1 = 2.0 * (planted & stands).sum() / total
        rows.append([*errors, speeds[0] / speeds[1], tilt, f1])
    net.train()
    return dict(zip(VALIDATED, np.mean(rows, 0).tolist(), strict=True))


def averaged(progress: Progress) -> Lifter:
    """Return the network with the running mean of its weights, on the processor."""
    net = lifter_of(progress.mean)
    net.load_state_dict(progress.mean)
    return net


def learn(progress: Progress, batch: Batch, config: FitConfig) -> torch.Tensor:
    """Take a step of the optimiser; returns `LOSSES`."""
    for group in progress.optimiser.param_groups:
        group["lr"] = config.rate * _schedule(progress.step, config)
    with torch.autocast(progress.net.mean.device.type, torch.bfloat16):
        h = progress.net.features(batch.numbers())
    losses, _ = losses_of(progress.net.head(h.float()), batch)
    weighted = [getattr(config, name, 1.0) * value for name, value in losses.items()]
    loss = 10.0 * torch.stack(weighted).sum()
    progress.optimiser.zero_grad()
    loss.backward()
    nn.utils.clip_grad_norm_(progress.net.parameters(), 1.0)
    progress.optimiser.step()
    memory = min(config.average, progress.step / (progress.step + 10.0))
    means, values = progress.mean, progress.net.state_dict()
    torch._foreach_lerp_(list(means.values()), [values[name] for name in means], 1.0 - memory)
    progress.step += 1
    return torch.stack(list(losses.values())).detach()


def _schedule(step: int, config: FitConfig) -> float:
    cosine = 0.5 * (1.0 + np.cos(np.pi * step / config.steps))
    return float(min(1.0, (step + 1) / config.warm_up) * (cosine + 0.01))
