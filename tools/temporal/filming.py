"""Cameras for motions without pictures: every window of a batch is filmed again.

All yaws, pitch of -20 to 60 degrees, rolls, lenses from wide to long, a person near or far and
beside the middle of the image; what is seen is exact, `invented.Detector` makes it a detector's.
"""

import math
from dataclasses import replace

import torch
from torch.nn.functional import normalize

from robojackson.mocap.landmarks.blazepose import landmark
from robojackson.mocap.landmarks.pinhole_camera import DOWN, FOCAL_PER_DIAGONAL
from robojackson.mocap.temporal import features
from tools.temporal.batches import Batch
from tools.temporal.depth_errors import ORDER, slow
from tools.temporal.random_numbers import RandomNumbers
from tools.temporal.tensors import index_on, numbers_on, turned
from tools.temporal.truths import Bank

TEMPO = (0.5, 1.35)
"""Playing speed of a window, times that of the motion."""
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
    bank: Bank, rows: torch.Tensor, frames: int, sizes: torch.Tensor, rng: RandomNumbers
) -> Batch:
    """Return a window of each row as an exact detector would see it.

    Args:
        bank: The motions.
        rows: Rows of the bank.
        frames: Length of a window.
        sizes: Size of each person in the detector's metres.
        rng: Draws windows, tempo and cameras.
    """
    count = len(rows)
    places = _places(bank, rows, frames, rng)
    points = proportioned(_played(bank.points, rows, places), rng) * sizes[:, None, None, None]
    seen, up = _before_cameras(points, rng)
    root = seen[:, :, _index(seen, HIPS)].mean(2)
    axes = axes_along(root)
    truth = turned(seen - root[:, :, None], axes)
    distance = torch.linalg.norm(root, dim=-1)
    away = distance[..., None, None]
    known = rng.chance(KNOWN, count, 1)
    guessed = FOCAL_PER_DIAGONAL / rng.log_uniform(*LENSES, count, 1)
    wrong = torch.where(known, torch.exp(rng.normal(count, 1) * KNOWN_FOCAL_SD), guessed)
    drift = slow(rng, (count, frames, 1), torch.ones(count, device=rng.device))
    above = turned(up[:, None, None], axes)[:, :, 0]
    return Batch(
        flat=truth[..., :2] * away / (away + truth[..., 2:]),
        local=truth,
        visibility=torch.ones_like(truth[..., 0]),
        constant=truth.new_zeros((count, 2 * (len(features.CHAINS) + 2) + 1)),
        distance=distance * wrong * (1.0 + drift[..., 0] * SWAY),
        truth=truth,
        good=torch.ones_like(distance),
        up=above,
        shown=above * known[..., None],
        contact=bank.contact[rows[:, None], torch.round(places).long()].float(),
    )


def with_constants(batch: Batch) -> Batch:
    """Add the constants of the clip, computed from its frames."""
    pairs = [[(f"{s}_{a}", f"{s}_{b}") for s in SIDES] for a, b in features.CHAINS.values()]
    pairs += [[(f"left_{name}", f"right_{name}")] for name in features.WIDTHS]
    longest, median = [], []
    for ends in pairs:
        starts, stops = (_index(batch.flat, [ORDER.index(landmark(p[k])) for p in ends])
                         for k in (0, 1))  # fmt: skip
        flat, local = (torch.linalg.norm(v[:, :, starts] - v[:, :, stops], dim=-1).flatten(1)
                       for v in (batch.flat, batch.local))  # fmt: skip
        longest.append(torch.quantile(flat, features.LONGEST / 100.0, dim=1))
        median.append(torch.quantile(local, 0.5, dim=1))
    near = 1.0 / batch.distance.mean(1).clamp(min=0.5)
    return replace(batch, constant=torch.stack([*longest, *median, near], -1))


def axes_along(root: torch.Tensor) -> torch.Tensor:
    """Return `features.axes_along` of many windows."""
    forward = normalize(root, dim=-1)
    down = numbers_on(root.device, *DOWN.tolist()).expand_as(forward)
    right = normalize(torch.linalg.cross(down, forward), dim=-1)
    return torch.stack([right, torch.linalg.cross(forward, right), forward], -1)


def proportioned(points: torch.Tensor, rng: RandomNumbers) -> torch.Tensor:
    """Return people whose bones are longer or shorter by a few per cent, another for each window;
    both sides alike, hips where they were."""
    factors = torch.exp(rng.normal(2 + len(LINKS), len(points), 1, 1, 1) * PROPORTION)
    wide, long, *limbs = factors
    hips, shoulders, head = (_index(points, rows) for rows in (HIPS, SHOULDERS, HEAD))
    changed, centre = points.clone(), points[:, :, hips].mean(2, keepdim=True)
    for rows, factor in ((hips, wide), (shoulders, long)):
        changed[:, :, rows] = centre + factor * (points[:, :, rows] - centre)
    shift = (changed - points)[:, :, shoulders].mean(2, keepdim=True)
    changed[:, :, head] = points[:, :, head] + shift
    for (start, end, followers), factor in zip(LINKS, limbs, strict=True):
        for side in SIDES:
            (first,), (last, *more) = _rows(side, start), _rows(side, end, *followers)
            bone = points[:, :, last] - points[:, :, first]
            shift = changed[:, :, first] + factor[:, 0] * bone - points[:, :, last]
            moved = _index(points, [last, *more])
            changed[:, :, moved] = points[:, :, moved] + shift[:, :, None]
    return changed


def _index(points: torch.Tensor, rows: list[int]) -> torch.Tensor:
    return index_on(points.device, *rows)


def _places(bank: Bank, rows: torch.Tensor, frames: int, rng: RandomNumbers) -> torch.Tensor:
    """Return the fractional frames of windows at any tempo."""
    tempo = rng.uniform(*TEMPO, len(rows))
    spare = (bank.lengths[rows] - 1 - tempo * frames).clamp(min=0.0)
    place = (rng.uniform(0.0, 1.0, len(rows)) * spare)[:, None]
    place = place + tempo[:, None] * torch.arange(frames, device=rng.device)
    return place.clamp(max=bank.points.shape[1] - 1.001)


def _played(points: torch.Tensor, rows: torch.Tensor, place: torch.Tensor) -> torch.Tensor:
    """Return windows of points, linear between frames."""
    low, each = place.long(), rows[:, None]
    part = (place - low)[..., None, None]
    return torch.lerp(points[each, low], points[each, low + 1], part)


def _before_cameras(points: torch.Tensor, rng: RandomNumbers) -> tuple[torch.Tensor, torch.Tensor]:
    """Return world points (B, L, N, 3), and up (B, 3), in the frame of a drawn camera each."""
    count = len(points)
    yaw = rng.uniform(-math.pi, math.pi, count)
    mean, deviation = LEVEL_DEG
    level = mean + deviation * rng.normal(count)
    pitch = torch.where(rng.chance(LEVEL_SHARE, count), level, rng.uniform(*PITCH_DEG, count))
    pitch = torch.deg2rad(pitch)
    forward = torch.stack(
        [-torch.sin(yaw) * torch.cos(pitch), torch.cos(yaw) * torch.cos(pitch), -torch.sin(pitch)],
        -1,
    )
    above = numbers_on(rng.device, 0.0, 0.0, 1.0).expand_as(forward)
    right = normalize(torch.linalg.cross(forward, above), dim=-1)
    down = torch.linalg.cross(forward, right)
    roll = torch.deg2rad(rng.normal(count) * ROLL_DEG)[:, None]
    across = torch.cos(roll) * right - torch.sin(roll) * down
    down = torch.sin(roll) * right + torch.cos(roll) * down
    rotation = torch.stack([across, down, forward], 1)
    centre = points[:, :, _index(points, HIPS)].mean((1, 2))
    seen = turned(points - centre[:, None, None], rotation.mT[:, None])
    nearest = NEAREST_M - seen[..., 2].amin((1, 2))
    distance = rng.log_uniform(*DISTANCE_M, count).maximum(nearest)
    aside = rng.normal(count, 2) * ASIDE * distance[:, None]
    shift = torch.cat([aside, distance[:, None]], -1)
    return seen + shift[:, None, None], rotation[:, :, 2]
