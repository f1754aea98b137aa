"""Examples as tables, and the batches that are drawn from them: windows mirrored, rolled, scaled,
shifted, shaken, and with whole limbs hidden for 0.2 to 1 s. All on the device of the training.

Axes: B windows, L frames, N landmarks (`features.INPUT_LANDMARKS`), N's truth beside what was seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import torch

from robojackson.mocap.landmarks.blazepose import BODY, MIRROR
from robojackson.mocap.temporal import features
from robojackson.mocap.temporal.features import FPS, INPUT_LANDMARKS
from tools.temporal.depth_errors import LIMBS, ORDER, Change, body_offsets, misjudged, of_limbs
from tools.temporal.examples import Example
from tools.temporal.random_numbers import RandomNumbers
from tools.temporal.tensors import index_on, numbers_on, turned

SWAP = [ORDER.index(int(MIRROR[index])) for index in INPUT_LANDMARKS]
TWELVE = [ORDER.index(int(index)) for index in BODY]
OTHER_FOOT = [2, 3, 0, 1]
UP_SD = 0.025
"""Standard deviation of the error of a known up, radians."""
LONGEST = 150
"""Frames of the longest example that are kept."""


@dataclass(frozen=True)
class Batch:
    """Windows, or whole examples.

    Attributes:
        flat, local, visibility: As in `features.ClipView`, of the landmarks that are read.
        constant: What the network knows of the clip.
        distance: Distance of the hips as placed, metres.
        truth: Truth of the same landmarks, NaN-free, metres.
        good: 1 in the frames that count, else 0.
        up: Direction against gravity, unit vectors (B, L, 3).
        contact: States of the foot points (B, L, 4).
        shown: The network's input of up (B, L, 3), zero where it is not known.
    """

    flat: torch.Tensor
    local: torch.Tensor
    visibility: torch.Tensor
    constant: torch.Tensor
    distance: torch.Tensor
    truth: torch.Tensor
    good: torch.Tensor
    up: torch.Tensor
    contact: torch.Tensor
    shown: torch.Tensor

    def numbers(self) -> torch.Tensor:
        """Return the network's input (B, L, F), as `features.numbers` orders it."""
        constant = self.constant[:, None].expand(-1, self.flat.shape[1], -1)
        parts = (self.flat.flatten(2), self.local.flatten(2), self.visibility, constant, self.shown)
        return torch.cat(parts, -1)

    def on(self, device: torch.device | str) -> "Batch":
        """Return the batch on a device."""
        return Batch(**{f.name: getattr(self, f.name).to(device) for f in fields(self)})


def table(examples: Sequence[Example]) -> Batch:
    """Return whole examples, the last frame held to a common length with no weight."""

    def stack(values: Sequence[np.ndarray]) -> torch.Tensor:
        index = [np.minimum(np.arange(LONGEST), len(v) - 1) for v in values]
        held = np.stack([v[i] for v, i in zip(values, index, strict=True)])
        return torch.from_numpy(held.astype(np.float32))

    sights = [e.sight for e in examples]
    good = [np.append(e.good, False)[: LONGEST + 1].astype(np.float32) for e in examples]
    constant = np.stack([features.constants(s) for s in sights]).astype(np.float32)
    return Batch(
        flat=stack([s.flat[:, INPUT_LANDMARKS] for s in sights]),
        local=stack([s.local[:, INPUT_LANDMARKS] for s in sights]),
        visibility=stack([s.visibility[:, INPUT_LANDMARKS] for s in sights]),
        constant=torch.from_numpy(constant),
        distance=stack([np.linalg.norm(s.root, axis=-1) for s in sights]),
        truth=stack([np.nan_to_num(e.truth[:, INPUT_LANDMARKS]) for e in examples]),
        good=stack(good),
        up=stack([e.up for e in examples]),
        contact=stack([e.contact for e in examples]),
        shown=stack([s.up for s in sights]),
    )


def lengths(good: torch.Tensor) -> torch.Tensor:
    """Return frames of each row up to the last that counts."""
    return LONGEST - torch.argmax((good.flip(1) > 0).to(torch.uint8), dim=1)


def windows(whole: Batch, rows: torch.Tensor, frames: int, rng: RandomNumbers) -> Batch:
    """Return a window of each row, anywhere in it."""
    latest = (lengths(whole.good[rows]) - frames).clamp(min=0)
    starts = (rng.uniform(0.0, 1.0, len(rows)) * (latest + 1)).long().minimum(latest)
    frame = starts[:, None] + torch.arange(frames, device=starts.device)
    index = (rows[:, None], frame.clamp(max=LONGEST - 1))
    cut = {f.name: getattr(whole, f.name)[index] for f in fields(whole) if f.name != "constant"}
    return Batch(**cut, constant=whole.constant[rows])


def joined(first: Batch, second: Batch) -> Batch:
    """Return both batches as one."""
    return Batch(
        **{f.name: torch.cat([getattr(first, f.name), getattr(second, f.name)])
           for f in fields(first)}
    )  # fmt: skip


def change(batch: Batch, how: Change, rng: RandomNumbers) -> Batch:
    """Return the windows, changed."""
    count = len(batch.flat)
    batch = _mirrored(batch, rng.chance(0.5, count))
    roll = _rolls(rng.normal(count) * how.roll_deg)
    size, metre = torch.exp(rng.normal(count) * how.size), torch.exp(rng.normal(count) * how.metre)
    grown = size[:, None, None, None]
    flat = _disturbed(turned(batch.flat, roll[..., :2, :2]) * grown, how, rng)
    truth = turned(batch.truth, roll) * grown
    wrong = body_offsets(truth, how, rng)
    flat = flat + wrong[..., :2] * how.body_in_image
    local = turned(batch.local, roll) * grown * metre[:, None, None, None] + wrong
    local = _disturbed(misjudged(local, how, rng), how, rng)
    flat, local, visibility = hide((flat, local, batch.visibility), how, rng)
    strides = rng.choice(how.strides, count) + 1
    half = (batch.constant.shape[1] - 1) // 2
    factors = torch.stack([size] * half + [size * metre] * half + [1.0 / size], -1)
    return replace(
        batch,
        flat=_thinned(flat, strides),
        local=_thinned(local, strides),
        visibility=_thinned(visibility[..., None], strides)[..., 0],
        constant=batch.constant * factors,
        distance=batch.distance * size[:, None],
        truth=truth,
        up=turned(batch.up, roll[:, 0]),
        shown=_misread(turned(batch.shown, roll[:, 0]), rng),
    )


def hide(
    seen: tuple[torch.Tensor, torch.Tensor, torch.Tensor], how: Change, rng: RandomNumbers
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Remove one or two limbs of some windows for a while: interpolate them between the frames
    around, hold them at the ends.

    Args:
        seen: Landmarks in the image and in space, and their visibility.
        how: How often, and how long.
        rng: Draws limbs and times.
    """
    flat, local, visibility = seen
    count, frames = visibility.shape[:2]
    some, twice = rng.chance(how.hidden, count), rng.chance(0.5, count)
    for which in (some, some & twice):
        limb = of_limbs(visibility.device)[rng.integers(len(LIMBS), count)]
        onset = rng.integers(frames, count) - 3
        end = (onset + (FPS * rng.uniform(*how.hidden_s, count)).long()).clamp(max=frames)
        frame = torch.arange(frames, device=onset.device)
        inside = (frame >= onset[:, None]) & (frame < end[:, None]) & which[:, None]
        gone = inside[..., None] & limb[:, None]
        flat, local = (_bridged(v, gone, onset.clamp(min=0), end) for v in (flat, local))
        visibility = visibility.masked_fill(gone, 0.0)
    return flat, local, visibility


def _bridged(
    values: torch.Tensor, gone: torch.Tensor, start: torch.Tensor, end: torch.Tensor
) -> torch.Tensor:
    """Return values (B, L, N, C) that are linear from frame `start` - 1 to `end` where `gone`."""
    each, frames = torch.arange(len(values), device=values.device), values.shape[1]
    before = values[each, (start - 1).clamp(min=0)]
    after = values[each, end.clamp(min=0, max=frames - 1)]
    before = torch.where((start == 0)[:, None, None], after, before)
    after = torch.where((end >= frames)[:, None, None], before, after)
    place = torch.arange(frames, device=values.device) - start[:, None] + 1
    share = (place / (end - start + 1).clamp(min=1)[:, None])[..., None, None]
    return torch.where(gone[..., None], torch.lerp(before[:, None], after[:, None], share), values)


def _thinned(values: torch.Tensor, strides: torch.Tensor) -> torch.Tensor:
    """Return values (B, L, N, C) of which each window keeps each `stride`-th frame, the others
    linear between them."""
    each = torch.arange(len(values), device=values.device)[:, None]
    frames, stride = torch.arange(values.shape[1], device=values.device), strides[:, None]
    last = values.shape[1] - 1
    low = (frames // stride * stride).clamp(max=last)
    high = (low + stride).minimum(last // stride * stride)
    part = ((frames - low) / stride)[..., None, None]
    return torch.lerp(values[each, low], values[each, high], part)


def _rolls(degrees: torch.Tensor) -> torch.Tensor:
    """Return rotations about z (B, 1, 3, 3), for row vectors."""
    angle = torch.deg2rad(degrees)
    roll = torch.zeros((len(angle), 1, 3, 3), device=angle.device)
    roll[:, 0, 0, 0] = roll[:, 0, 1, 1] = torch.cos(angle)
    roll[:, 0, 0, 1], roll[:, 0, 1, 0] = torch.sin(angle), -torch.sin(angle)
    roll[:, 0, 2, 2] = 1.0
    return roll


def _mirrored(batch: Batch, which: torch.Tensor) -> Batch:
    flip = numbers_on(which.device, -1.0, 1.0, 1.0)
    swap, feet = index_on(which.device, *SWAP), index_on(which.device, *OTHER_FOOT)
    three, four = which[:, None, None], which[:, None, None, None]
    return replace(
        batch,
        flat=torch.where(four, batch.flat[:, :, swap] * flip[:2], batch.flat),
        local=torch.where(four, batch.local[:, :, swap] * flip, batch.local),
        truth=torch.where(four, batch.truth[:, :, swap] * flip, batch.truth),
        visibility=torch.where(three, batch.visibility[:, :, swap], batch.visibility),
        up=torch.where(three, batch.up * flip, batch.up),
        shown=torch.where(three, batch.shown * flip, batch.shown),
        contact=torch.where(three, batch.contact[..., feet], batch.contact),
    )


def _misread(shown: torch.Tensor, rng: RandomNumbers) -> torch.Tensor:
    """Return known directions of up with the same error throughout a window."""
    known = torch.linalg.norm(shown, dim=-1, keepdim=True) > 0.5
    return (shown + rng.normal(len(shown), 1, 3) * UP_SD) * known


def _disturbed(values: torch.Tensor, how: Change, rng: RandomNumbers) -> torch.Tensor:
    count, _, *rest = values.shape
    shift = rng.normal(count, 1, *rest) * how.shift_m
    return values + shift + rng.normal(*values.shape) * how.shake_m
