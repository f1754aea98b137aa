"""How a detector may misjudge depth on people other than the rendered ones, and how much windows
are changed at all.

Drawn wide on purpose: a network that has only met the errors of one detector on renderings takes
those of real people for motion.
"""

import math
from dataclasses import dataclass
from functools import cache

import torch
from torch.nn.functional import normalize

from robojackson.mocap.landmarks.blazepose import landmark
from robojackson.mocap.temporal.features import FPS, INPUT_LANDMARKS
from tools.temporal.random_numbers import RandomNumbers
from tools.temporal.tensors import index_on, numbers_on, turned

ORDER = [int(index) for index in INPUT_LANDMARKS]
LIMBS = [
    [ORDER.index(landmark(f"{side}_{name}")) for name in names]
    for side in ("left", "right")
    for names in (("elbow", "wrist", "index", "pinky"), ("knee", "ankle", "heel", "foot_index"))
]
TRUNK = [
    ORDER.index(landmark(f"{side}_{name}"))
    for name in ("hip", "shoulder")
    for side in ("left", "right")
]
REVERSED_S = (0.2, 1.5)
"""How long the depth of a limb is reversed."""
SHORTEST_S, DRIFT_S = 0.15, (0.15, 0.8)
"""Shortest time over which noise that is slow changes, and the times of the drift of depth."""


@dataclass(frozen=True)
class Change:
    """How much windows are changed.

    Attributes:
        frames: Length of a window.
        roll_deg: Roll of the camera, standard deviation.
        size: Size of the person, standard deviation of the logarithm.
        metre: Length of the detector's metre, likewise.
        shift_m: Shift of each landmark across the image for the whole window, because joints are
            not defined alike everywhere.
        tilt_deg: Tilt of the detector's body about the image's x and y axes, and
        depth: the logarithm of its depth, and
        depth_shift_m: the depth of each landmark, for the whole window, standard deviations:
            the detector errs in other ways on pictures of real people than on rendered ones.
        body_m: Constant error of each landmark in the body's own axes for the whole window, and
        body_limb_m: that which a whole limb shares; the image shows `body_in_image` of it.
        drift_m: Slow drift of the depth of each landmark, for windows whose depth is bad.
        bad_depth: Chance of that, and of limbs whose depth is reversed for a while.
        no_depth: Chance that the detector gives no depth at all.
        shake_m: Error of each landmark in each frame.
        hidden: Chance of hidden limbs.
        hidden_s: How long they are hidden.
        strides: Chances that the clip has 30, 15 or 10 frames a second.
    """

    frames: int = 81
    roll_deg: float = 12.0
    size: float = 0.07
    metre: float = 0.04
    shift_m: float = 0.012
    tilt_deg: tuple[float, float] = (12.0, 8.0)
    depth: float = 0.2
    depth_shift_m: float = 0.04
    body_m: float = 0.03
    body_limb_m: float = 0.03
    body_in_image: float = 0.25
    drift_m: float = 0.07
    bad_depth: float = 0.4
    no_depth: float = 0.4
    shake_m: float = 0.004
    hidden: float = 0.4
    hidden_s: tuple[float, float] = (0.2, 1.0)
    strides: tuple[float, float, float] = (0.6, 0.2, 0.2)


HARDER = Change(
    tilt_deg=(15.0, 11.0), depth=0.3, depth_shift_m=0.05, body_m=0.04, body_limb_m=0.045,
    drift_m=0.09, bad_depth=0.5, no_depth=0.45,
)  # fmt: skip
"""A detector that errs more."""


@cache
def of_limbs(device: torch.device) -> torch.Tensor:
    """Return which landmarks belong to each limb (4, N), true or false."""
    belongs = torch.zeros((len(LIMBS), len(ORDER)), dtype=torch.bool)
    for row, limb in zip(belongs, LIMBS, strict=True):
        row[limb] = True
    return belongs.to(device)


def misjudged(local: torch.Tensor, how: Change, rng: RandomNumbers) -> torch.Tensor:
    """Tilt, flatten or deepen the detector's body and shift each landmark's depth.

    In some windows it drifts and limbs are reversed, or there is no depth at all.
    """
    count, frames, landmarks = local.shape[:3]
    angles = torch.deg2rad(rng.normal(count, 2) * numbers_on(rng.device, *how.tilt_deg))
    body = turned(local, _tilts(angles))
    deep = torch.exp(rng.normal(count, 1, 1) * how.depth)
    depth = body[..., 2] * deep + rng.normal(count, 1, landmarks) * how.depth_shift_m
    bad = rng.chance(how.bad_depth, count)
    drift = bad * how.drift_m * rng.uniform(0.2, 1.5, count)
    seconds = rng.uniform(*DRIFT_S, count)
    depth = depth + slow(rng, (count, frames, landmarks), seconds) * drift[:, None, None]
    depth = torch.where((bad & rng.chance(0.5, count))[:, None, None], _reversed(depth, rng), depth)
    depth = depth.masked_fill(rng.chance(how.no_depth, count)[:, None, None], 0.0)
    return torch.cat([body[..., :2], depth[..., None]], -1)


def body_offsets(truth: torch.Tensor, how: Change, rng: RandomNumbers) -> torch.Tensor:
    """Return errors (B, L, N, 3) that are constant in the axes of each window's trunk.

    On real cameras 44 to 58 of 70 mm are of this kind, another pattern in every clip.
    """
    count, _, landmarks = truth.shape[:3]
    left, right, *shoulders = (truth[:, :, index] for index in TRUNK)
    x = normalize(left - right, dim=-1)
    spine = shoulders[0] + shoulders[1] - left - right
    y = normalize(spine - (spine * x).sum(-1, keepdim=True) * x, dim=-1)
    axes = torch.stack([x, y, torch.linalg.cross(x, y)], -2)
    offsets = rng.normal(count, landmarks, 3) * how.body_m
    shared = rng.normal(count, len(LIMBS), 3) * how.body_limb_m
    offsets = offsets + (of_limbs(truth.device).float().T @ shared)
    offsets = offsets - offsets[:, index_on(rng.device, *TRUNK[:2])].mean(1, keepdim=True)
    return turned(offsets[:, None], axes)


def slow(rng: RandomNumbers, shape: tuple[int, int, int], seconds: torch.Tensor) -> torch.Tensor:
    """Return noise (B, L, N) of unit size; each window's changes over a number of seconds (B)."""
    count, frames, width = shape
    span = frames / FPS
    knots = math.ceil(span / SHORTEST_S) + 3
    values = rng.normal(count, knots, width)
    frame = torch.arange(frames, device=rng.device)
    place = rng.uniform(0.0, 1.0, count, 1) + frame / FPS / seconds.clamp(min=SHORTEST_S)[:, None]
    low = place.long()
    part = (place - low)[..., None]
    part = part * part * (3.0 - 2.0 * part)
    each = torch.arange(count, device=rng.device)[:, None]
    return torch.lerp(values[each, low], values[each, low + 1], part)


def _tilts(angles: torch.Tensor) -> torch.Tensor:
    """Return rotations about x, then y, by angles (B, 2), radians: (B, 1, 3, 3)."""
    (cx, cy), (sx, sy) = torch.cos(angles).unbind(-1), torch.sin(angles).unbind(-1)
    zero = torch.zeros_like(cx)
    rows = [torch.stack(row, -1) for row in (
        (cy, sy * sx, sy * cx), (zero, cx, -sx), (-sy, cy * sx, cy * cx))]  # fmt: skip
    return torch.stack(rows, -2)[:, None]


def _reversed(depth: torch.Tensor, rng: RandomNumbers) -> torch.Tensor:
    """Return depth (B, L, N) of which one limb bends towards the camera instead of away for a
    while, or vice versa."""
    count, frames = depth.shape[:2]
    limb = rng.integers(len(LIMBS), count)
    start = rng.integers(frames, count)
    end = start + (FPS * rng.uniform(*REVERSED_S, count)).long()
    frame = torch.arange(frames, device=depth.device)
    inside = (frame >= start[:, None]) & (frame < end[:, None])
    roots = index_on(depth.device, *(limb[0] for limb in LIMBS))[limb]
    joint = torch.take_along_dim(depth, roots[:, None, None], 2)
    wrong = inside[..., None] & of_limbs(depth.device)[limb][:, None]
    return torch.where(wrong, 2.0 * joint - depth, depth)
