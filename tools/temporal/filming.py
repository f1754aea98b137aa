"""Cameras for motions without pictures: every window of a batch is filmed again.

All yaws, pitch of -20 to 60 degrees, rolls, lenses from wide to long, a person near or far and
beside the middle of the image; what is seen is exact, `invented.Detector` makes it a detector's.
"""

from dataclasses import replace

import numpy as np

from robojackson.body.forward_kinematics import unit
from robojackson.mocap.landmarks.blazepose import landmark
from robojackson.mocap.landmarks.pinhole_camera import DOWN, FOCAL_PER_DIAGONAL
from robojackson.mocap.temporal import features
from tools.temporal.batches import Batch
from tools.temporal.depth_errors import ORDER, slow
from tools.temporal.truths import Bank

TEMPO = (0.75, 1.35)
LEVEL_DEG, LEVEL_SHARE = (6.0, 9.0), 0.5
"""Pitch of the cameras that are held level, and their share; the others have any pitch."""
PITCH_DEG = (-20.0, 60.0)
ROLL_DEG = 5.0
DISTANCE_M = (1.8, 9.0)
NEAREST_M = 0.7
ASIDE = 0.2
"""Standard deviation of the person's place beside the axis, in shares of the distance."""
LENSES = (0.55, 1.7)
"""Focal length over the image's diagonal."""
KNOWN, KNOWN_FOCAL_SD = 0.5, 0.03
"""Share of windows of which up and the focal length are known; its relative error then."""
SWAY = 0.02
"""Of the distance that is found, slowly varying, share."""
HIPS = [ORDER.index(index) for index in features.HIPS]
PROPORTION = 0.04
"""Standard deviation of the logarithm of a bone's length."""
SIDES = ("left", "right")


def _rows(side: str, *names: str) -> list[int]:
    return [ORDER.index(landmark(f"{side}_{name}")) for name in names]


LINKS = (
    ("hip", "knee", ()), ("knee", "ankle", ("heel", "foot_index")),
    ("shoulder", "elbow", ()), ("elbow", "wrist", ("index", "pinky")),
)  # fmt: skip
"""Start and end of a bone, and what moves with its end; from the trunk outwards."""
HEAD = [ORDER.index(landmark(name)) for name in ("nose", "left_ear", "right_ear")]
SHOULDERS = [ORDER.index(landmark(f"{side}_shoulder")) for side in SIDES]


def film(
    bank: Bank, rows: np.ndarray, frames: int, sizes: np.ndarray, rng: np.random.Generator
) -> Batch:
    """Return a window of each row as an exact detector would see it.

    Args:
        bank: The motions.
        rows: Rows of the bank.
        frames: Length of a window.
        sizes: Size of each person in the detector's metres.
        rng: Draws windows, tempo and cameras.
    """
    places = _places(bank, rows, frames, rng)
    points = proportioned(_played(bank.points, rows, places), rng) * sizes[:, None, None, None]
    seen, up = _before_cameras(points, rng)
    root = seen[:, :, HIPS].mean(2)
    axes = axes_along(root)
    truth = (seen - root[:, :, None]) @ axes
    distance = np.linalg.norm(root, axis=-1)
    away = distance[..., None, None]
    count = len(rows)
    known = rng.uniform(size=(count, 1)) < KNOWN
    wrong = FOCAL_PER_DIAGONAL / np.exp(rng.uniform(*np.log(LENSES), (count, 1)))
    wrong = np.where(known, np.exp(rng.normal(0.0, KNOWN_FOCAL_SD, (count, 1))), wrong)
    wrong = wrong * (1.0 + slow(rng, (count, frames, 1), 1.0)[..., 0] * SWAY)
    flat = truth[..., :2] * away / (away + truth[..., 2:])
    above = (up[:, None, None] @ axes)[:, :, 0].astype(np.float32)
    return Batch(
        flat=flat.astype(np.float32),
        local=truth.astype(np.float32),
        visibility=np.ones(truth.shape[:3], np.float32),
        constant=np.zeros((count, 2 * (len(features.CHAINS) + 2) + 1), np.float32),
        distance=(distance * wrong).astype(np.float32),
        truth=truth.astype(np.float32),
        good=np.ones((count, frames), np.float32),
        up=above,
        shown=above * known[..., None].astype(np.float32),
        contact=bank.contact[rows[:, None], np.round(places).astype(int)].astype(np.float32),
    )


def with_constants(batch: Batch) -> Batch:
    """Add the constants of the clip, computed from its frames."""
    pairs = [[(f"{s}_{a}", f"{s}_{b}") for s in ("left", "right")]
             for a, b in features.CHAINS.values()]  # fmt: skip
    pairs += [[(f"left_{name}", f"right_{name}")] for name in features.WIDTHS]
    longest, median = [], []
    for ends in pairs:
        starts, stops = ([ORDER.index(landmark(p[k])) for p in ends] for k in (0, 1))
        spans = [np.linalg.norm(v[:, :, starts] - v[:, :, stops], axis=-1)
                 for v in (batch.flat, batch.local)]  # fmt: skip
        flat, local = (span.reshape(len(span), -1) for span in spans)
        longest.append(np.percentile(flat, features.LONGEST, axis=1))
        median.append(np.median(local, axis=1))
    near = 1.0 / np.maximum(batch.distance.mean(1), 0.5)
    return replace(batch, constant=np.stack([*longest, *median, near], -1).astype(np.float32))


def axes_along(root: np.ndarray) -> np.ndarray:
    """Return `features.axes_along` of many windows."""
    forward = unit(root)
    right = unit(np.cross(np.broadcast_to(DOWN, forward.shape), forward))
    return np.stack([right, np.cross(forward, right), forward], -1)


def proportioned(points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return people whose bones are longer or shorter by a few per cent, another for each window;
    both sides alike, hips where they were."""
    factors = np.exp(rng.normal(0.0, PROPORTION, (2 + len(LINKS), len(points), 1, 1, 1)))
    wide, long, *limbs = factors.astype(np.float32)
    changed, centre = points.copy(), points[:, :, HIPS].mean(2, keepdims=True)
    for rows, factor in ((HIPS, wide), (SHOULDERS, long)):
        changed[:, :, rows] = centre + factor * (points[:, :, rows] - centre)
    shift = (changed - points)[:, :, SHOULDERS].mean(2, keepdims=True)
    changed[:, :, HEAD] = points[:, :, HEAD] + shift
    for (start, end, followers), factor in zip(LINKS, limbs, strict=True):
        for side in SIDES:
            (first,), (last, *more) = _rows(side, start), _rows(side, end, *followers)
            bone = points[:, :, last] - points[:, :, first]
            shift = changed[:, :, first] + factor[:, 0] * bone - points[:, :, last]
            changed[:, :, [last, *more]] = points[:, :, [last, *more]] + shift[:, :, None]
    return changed


def _places(bank: Bank, rows: np.ndarray, frames: int, rng: np.random.Generator) -> np.ndarray:
    """Return the fractional frames of windows at any tempo."""
    tempo = rng.uniform(*TEMPO, len(rows))
    spare = np.maximum(bank.lengths[rows] - 1 - tempo * frames, 0.0)
    place = rng.uniform(0.0, 1.0, len(rows))[:, None] * spare[:, None]
    place = place + tempo[:, None] * np.arange(frames)
    return np.asarray(np.minimum(place, bank.points.shape[1] - 1.001))


def _played(points: np.ndarray, rows: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return windows of points, linear between frames."""
    low = place.astype(int)
    part = (place - low)[..., None, None].astype(np.float32)
    each = rows[:, None]
    return np.asarray(points[each, low] * (1.0 - part) + points[each, low + 1] * part)


def _before_cameras(points: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return world points (B, L, N, 3), and up (B, 3), in the frame of a drawn camera each."""
    count = len(points)
    yaw = rng.uniform(-np.pi, np.pi, count)
    level = rng.uniform(size=count) < LEVEL_SHARE
    pitch = np.where(level, rng.normal(*LEVEL_DEG, count), rng.uniform(*PITCH_DEG, count))
    pitch = np.radians(pitch)
    forward = np.stack(
        [-np.sin(yaw) * np.cos(pitch), np.cos(yaw) * np.cos(pitch), -np.sin(pitch)], -1
    )
    right = unit(np.cross(forward, [0.0, 0.0, 1.0]))
    down = np.cross(forward, right)
    roll = np.radians(rng.normal(0.0, ROLL_DEG, count))[:, None]
    across = np.cos(roll) * right - np.sin(roll) * down
    down = np.sin(roll) * right + np.cos(roll) * down
    rotation = np.stack([across, down, forward], 1)
    centre = points[:, :, HIPS].mean((1, 2))
    seen = (points - centre[:, None, None]) @ np.swapaxes(rotation, 1, 2)[:, None]
    distance = np.exp(rng.uniform(*np.log(DISTANCE_M), count))
    distance = np.maximum(distance, NEAREST_M - seen[..., 2].min((1, 2)))
    aside = rng.normal(0.0, ASIDE, (count, 2)) * distance[:, None]
    shift = np.concatenate([aside, distance[:, None]], -1)
    return seen + shift[:, None, None], rotation[:, :, 2]
