"""How a detector may misjudge depth on people other than the rendered ones, and how much windows
are changed at all.

Drawn wide on purpose: a network that has only met the errors of one detector on renderings takes
those of real people for motion.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from robojackson.body.forward_kinematics import unit
from robojackson.mocap.landmarks.blazepose import landmark
from robojackson.mocap.temporal.features import FPS, INPUT_LANDMARKS

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


def misjudged(local: np.ndarray, how: Change, rng: np.random.Generator) -> np.ndarray:
    """Tilt, flatten or deepen the detector's body and shift each landmark's depth.

    In some windows it drifts and limbs are reversed, or there is no depth at all.
    """
    count, frames, landmarks = local.shape[:3]
    angles = np.radians(rng.normal(0.0, 1.0, (count, 2)) * how.tilt_deg)
    turns = Rotation.from_euler("xy", angles).as_matrix().astype(np.float32)
    turned = local @ turns[:, None]
    deep = np.exp(rng.normal(0.0, how.depth, (count, 1, 1))).astype(np.float32)
    shift = rng.standard_normal((count, 1, landmarks), np.float32) * how.depth_shift_m
    depth = turned[..., 2] * deep + shift
    bad = rng.uniform(size=count) < how.bad_depth
    drift = how.drift_m * rng.uniform(0.2, 1.5, count)[bad]
    seconds = float(rng.uniform(0.15, 0.8))
    depth[bad] += slow(rng, (int(bad.sum()), frames, landmarks), seconds) * drift[:, None, None]
    for row in np.flatnonzero(bad):
        if rng.uniform() < 0.5:
            _reverse(depth[row], rng)
    depth[rng.uniform(size=count) < how.no_depth] = 0.0
    turned[..., 2] = depth
    return np.asarray(turned)


def body_offsets(truth: np.ndarray, how: Change, rng: np.random.Generator) -> np.ndarray:
    """Return errors (B, L, N, 3) that are constant in the axes of each window's trunk.

    On real cameras 44 to 58 of 70 mm are of this kind, another pattern in every clip.
    """
    count, _, landmarks = truth.shape[:3]
    left, right, *shoulders = (truth[:, :, index] for index in TRUNK)
    x = unit(left - right)
    spine = sum(shoulders) - left - right
    y = unit(spine - (spine * x).sum(-1, keepdims=True) * x)
    axes = np.stack([x, y, np.cross(x, y)], -2).astype(np.float32)
    offsets = rng.standard_normal((count, landmarks, 3), np.float32) * how.body_m
    for limb in LIMBS:
        offsets[:, limb] += rng.standard_normal((count, 1, 3), np.float32) * how.body_limb_m
    offsets -= offsets[:, TRUNK[:2]].mean(1, keepdims=True)
    return np.asarray(offsets[:, None] @ axes)


def slow(rng: np.random.Generator, shape: tuple[int, int, int], seconds: float) -> np.ndarray:
    """Return noise (B, L, N) of unit size that changes over a number of seconds."""
    count, frames, width = shape
    knots = int(np.ceil(frames / FPS / seconds)) + 3
    values = rng.standard_normal((count, knots, width), np.float32)
    place = rng.uniform(0.0, 1.0, (count, 1)) + np.arange(frames) / FPS / seconds
    low = place.astype(int)
    part = (place - low)[..., None].astype(np.float32)
    part = part * part * (3.0 - 2.0 * part)
    each = np.arange(count)[:, None]
    return np.asarray(values[each, low] * (1.0 - part) + values[each, low + 1] * part)


def _reverse(depth: np.ndarray, rng: np.random.Generator) -> None:
    """Bend one limb towards the camera instead of away for a while, or vice versa, in place."""
    limb = LIMBS[rng.integers(len(LIMBS))]
    start = int(rng.integers(0, len(depth)))
    span = slice(start, start + int(FPS * rng.uniform(*REVERSED_S)))
    joint = depth[span, limb[:1]]
    depth[span, limb[1:]] = 2.0 * joint - depth[span, limb[1:]]
