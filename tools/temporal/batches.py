"""Examples as tables, and the batches that are drawn from them: windows mirrored, rolled, scaled,
shifted, shaken, and with whole limbs hidden for 0.2 to 1 s.

Axes: B windows, L frames, N landmarks (`features.INPUT_LANDMARKS`), N's truth beside what was seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from robojackson.mocap.landmarks.blazepose import BODY, MIRROR
from robojackson.mocap.temporal import features
from robojackson.mocap.temporal.features import FPS, INPUT_LANDMARKS
from tools.temporal.depth_errors import LIMBS, ORDER, Change, body_offsets, misjudged
from tools.temporal.examples import Example

SWAP = [ORDER.index(int(MIRROR[index])) for index in INPUT_LANDMARKS]
TWELVE = [ORDER.index(int(index)) for index in BODY]
OTHER_FOOT = (2, 3, 0, 1)
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

    flat: np.ndarray
    local: np.ndarray
    visibility: np.ndarray
    constant: np.ndarray
    distance: np.ndarray
    truth: np.ndarray
    good: np.ndarray
    up: np.ndarray
    contact: np.ndarray
    shown: np.ndarray

    def numbers(self) -> np.ndarray:
        """Return the network's input (B, L, F), as `features.numbers` orders it."""
        shape = self.flat.shape[:2]
        constant = np.broadcast_to(self.constant[:, None], (*shape, self.constant.shape[1]))
        parts = (self.flat.reshape(*shape, -1), self.local.reshape(*shape, -1), self.visibility)
        return np.concatenate([*parts, constant, self.shown], -1).astype(np.float32)


def table(examples: Sequence[Example]) -> Batch:
    """Return whole examples, the last frame held to a common length with no weight."""

    def stack(values: Sequence[np.ndarray]) -> np.ndarray:
        index = [np.minimum(np.arange(LONGEST), len(v) - 1) for v in values]
        return np.stack([v[i] for v, i in zip(values, index, strict=True)]).astype(np.float32)

    sights = [e.sight for e in examples]
    good = [np.append(e.good, False)[: LONGEST + 1].astype(np.float32) for e in examples]
    return Batch(
        flat=stack([s.flat[:, INPUT_LANDMARKS] for s in sights]),
        local=stack([s.local[:, INPUT_LANDMARKS] for s in sights]),
        visibility=stack([s.visibility[:, INPUT_LANDMARKS] for s in sights]),
        constant=np.stack([features.constants(s) for s in sights]).astype(np.float32),
        distance=stack([np.linalg.norm(s.root, axis=-1) for s in sights]),
        truth=stack([np.nan_to_num(e.truth[:, INPUT_LANDMARKS]) for e in examples]),
        good=stack(good),
        up=stack([e.up for e in examples]),
        contact=stack([e.contact for e in examples]),
        shown=stack([s.up for s in sights]),
    )


def lengths(good: np.ndarray) -> np.ndarray:
    """Return frames of each row up to the last that counts."""
    return LONGEST - np.argmax(good[:, ::-1] > 0, axis=1)


def windows(whole: Batch, rows: np.ndarray, frames: int, rng: np.random.Generator) -> Batch:
    """Return a window of each row, anywhere in it."""
    latest = np.maximum(lengths(whole.good[rows]) - frames, 0)
    starts = rng.integers(0, latest + 1)
    index = (rows[:, None], np.minimum(starts[:, None] + np.arange(frames), LONGEST - 1))
    cut = {f.name: getattr(whole, f.name)[index] for f in fields(whole) if f.name != "constant"}
    return Batch(**cut, constant=whole.constant[rows])


def joined(first: Batch, second: Batch) -> Batch:
    """Return both batches as one."""
    return Batch(
        **{
            f.name: np.concatenate([getattr(first, f.name), getattr(second, f.name)])
            for f in fields(first)
        }
    )


def change(batch: Batch, how: Change, rng: np.random.Generator) -> Batch:
    """Return the windows, changed."""
    count = len(batch.flat)
    batch = _mirrored(batch, rng.uniform(size=count) < 0.5)
    angle = np.radians(rng.normal(0.0, how.roll_deg, count))
    roll = np.zeros((count, 1, 3, 3), np.float32)
    roll[:, 0, 0, 0] = roll[:, 0, 1, 1] = np.cos(angle)
    roll[:, 0, 0, 1], roll[:, 0, 1, 0] = np.sin(angle), -np.sin(angle)
    roll[:, 0, 2, 2] = 1.0
    size = np.exp(rng.normal(0.0, how.size, count)).astype(np.float32)
    metre = np.exp(rng.normal(0.0, how.metre, count)).astype(np.float32)
    grown = size[:, None, None, None]
    flat = _disturbed(batch.flat @ roll[..., :2, :2] * grown, how, rng)
    truth = batch.truth @ roll * grown
    wrong = body_offsets(truth, how, rng)
    flat = flat + wrong[..., :2] * how.body_in_image
    local = batch.local @ roll * grown * metre[:, None, None, None] + wrong
    local = _disturbed(misjudged(local, how, rng), how, rng)
    visibility = np.array(batch.visibility)
    for row in np.flatnonzero(rng.uniform(size=count) < how.hidden):
        for _ in range(rng.integers(1, 3)):
            hide((flat[row], local[row]), visibility[row], how.hidden_s, rng)
    _thin((flat, local, visibility), rng.choice(3, count, p=how.strides) + 1)
    half = (batch.constant.shape[1] - 1) // 2
    factors = np.stack([size] * half + [size * metre] * half + [1.0 / size], -1)
    return replace(
        batch,
        flat=flat,
        local=local,
        visibility=visibility,
        constant=batch.constant * factors,
        distance=batch.distance * size[:, None],
        truth=truth,
        up=(batch.up[:, :, None] @ roll)[:, :, 0],
        shown=_misread((batch.shown[:, :, None] @ roll)[:, :, 0], rng),
    )


def hide(
    seen: Sequence[np.ndarray], visibility: np.ndarray, hidden_s: tuple[float, float],
    rng: np.random.Generator,
) -> None:  # fmt: skip
    """Remove a limb: interpolate it between the frames around, hold it at the ends."""
    count, limb = len(visibility), LIMBS[rng.integers(len(LIMBS))]
    onset = int(rng.integers(-3, count - 3))
    start, end = max(onset, 0), min(onset + int(FPS * rng.uniform(*hidden_s)), count)
    if end <= start:
        return
    share = ((np.arange(start, end) - start + 1) / (end - start + 1))[:, None, None]
    for values in seen:
        before, after = values[max(start - 1, 0), limb], values[min(end, count - 1), limb]
        before = after if start == 0 else before
        after = before if end == count else after
        values[start:end, limb] = before * (1.0 - share) + after * share
    visibility[start:end, limb] = 0.0


def _thin(seen: Sequence[np.ndarray], strides: np.ndarray) -> None:
    """Keep each second or third frame, the others between them, in place."""
    for stride in (2, 3):
        rows = np.flatnonzero(strides == stride)
        for values in seen:
            count = values.shape[1]
            frames = np.arange(count)
            low = np.minimum(frames // stride * stride, count - 1)
            high = np.minimum(low + stride, (count - 1) // stride * stride)
            part = ((frames - low) / stride).reshape(-1, *[1] * (values.ndim - 2))
            part = part.astype(values.dtype)
            chosen = values[rows]
            values[rows] = chosen[:, low] * (1 - part) + chosen[:, high] * part


def _mirrored(batch: Batch, which: np.ndarray) -> Batch:
    flip = np.array([-1.0, 1.0, 1.0], np.float32)
    pick = which[:, None, None, None]
    return replace(
        batch,
        flat=np.where(pick, batch.flat[:, :, SWAP] * flip[:2], batch.flat),
        local=np.where(pick, batch.local[:, :, SWAP] * flip, batch.local),
        truth=np.where(pick, batch.truth[:, :, SWAP] * flip, batch.truth),
        visibility=np.where(pick[..., 0], batch.visibility[:, :, SWAP], batch.visibility),
        up=np.where(pick[..., 0], batch.up * flip, batch.up),
        shown=np.where(pick[..., 0], batch.shown * flip, batch.shown),
        contact=np.where(pick[..., 0], batch.contact[..., OTHER_FOOT], batch.contact),
    )


def _misread(shown: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return known directions of up with the same error throughout a window."""
    known = np.linalg.norm(shown, axis=-1, keepdims=True) > 0.5
    return np.asarray((shown + rng.normal(0.0, UP_SD, (len(shown), 1, 3))) * known)


def _disturbed(values: np.ndarray, how: Change, rng: np.random.Generator) -> np.ndarray:
    count, _, *rest = values.shape
    shift = rng.standard_normal((count, 1, *rest), np.float32) * how.shift_m
    return np.asarray(values + shift + rng.standard_normal(values.shape, np.float32) * how.shake_m)
