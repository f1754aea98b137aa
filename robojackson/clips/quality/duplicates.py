"""Copies of a clip among candidates, mirrored ones included, recognised by how the person moves.

A copy may be smaller, cropped, recoloured, recompressed or start later, so pictures are not
compared but poses: landmarks relative to the hips, divided by the body's height.
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from pydantic import Field

from robojackson.clips.people.person_extent import MIRROR, heights_px, indices
from robojackson.clips.rejection import Rejection
from robojackson.config import config_dataclass
from robojackson.motion.landmark_track import LandmarkTrack

DELAY_COST = 0.01
"""Body heights a second of delay: a cyclic dance is its own mirror half a cycle later."""
ROUGH_POSES, ROUGH_LEAST, ROUGH_FACTOR = 10, 5, 3.0
"""Of one clip a pose a second, at least so many, is compared first; fewer that both show decide
nothing; clips more limits apart are no copies."""
Poses = Float[np.ndarray, "N 33 2"]


@config_dataclass
class DuplicateConfig:
    """Configuration of finding copies.

    Attributes:
        distance: Mean distance of the landmarks below which two clips show the same, body heights.
        rate: Poses a second that are compared.
        lag_s: Longest delay between two copies, seconds.
        overlap: Least share of the shorter clip that both must show.
    """

    distance: float = Field(default=0.03, gt=0)
    rate: float = Field(default=10.0, gt=0)
    lag_s: float = Field(default=2.0, ge=0)
    overlap: float = Field(default=0.6, gt=0, le=1)


def find_duplicates(
    tracks: Mapping[str, LandmarkTrack], config: DuplicateConfig
) -> dict[str, Rejection]:
    """Return the clips that are copies, each with the rejection that names the clip that stays.

    Args:
        tracks: Tracks by name, the best picture first: of two copies the later one is the copy.
        config: Limits.
    """
    found: dict[str, Rejection] = {}
    kept: dict[str, Poses] = {}
    for name, track in tracks.items():
        mine = poses(track, config.rate)
        turned_mine = mirrored(mine)
        for other, theirs in kept.items():
            same, turned = (
                distance(one, theirs, config) if _may_be_copies(one, theirs, config) else np.inf
                for one in (mine, turned_mine)
            )
            if min(same, turned) <= config.distance:
                found[name] = Rejection("mirrored_copy" if turned < same else "copy", other=other)
                break
        else:
            kept[name] = mine
    return found


def poses(track: LandmarkTrack, rate: float) -> Poses:
    """Return landmarks relative to the middle of the hips, in body heights, `rate` times a
    second."""
    size = np.array([track.width, track.height])
    xy = track.landmarks[..., :2] * size
    hips = xy[:, indices(("left_hip", "right_hip"))].mean(1, keepdims=True)
    tall = np.nanmedian(heights_px(track)) if track.detected.any() else np.nan
    count = max(1, int(len(track) / track.fps * rate))
    chosen = np.minimum((np.arange(count) / rate * track.fps).round().astype(int), len(track) - 1)
    result: Poses = ((xy - hips) / tall)[chosen]
    return result


def mirrored(seen: Poses) -> Poses:
    """Return the same poses in a mirror: left is right, in the image and in the names."""
    result: Poses = seen[:, list(MIRROR)] * np.array([-1.0, 1.0])
    return result


def distance(one: Poses, two: Poses, config: DuplicateConfig) -> float:
    """Return the least mean distance over all delays, which cost a little; infinite when nothing
    overlaps."""
    least = _least(one, two, config)
    costs = (
        _at(one, two, lag, least) + DELAY_COST * abs(lag) / config.rate for lag in _lags(config)
    )
    return min(costs, default=np.inf)


def _may_be_copies(one: Poses, two: Poses, config: DuplicateConfig) -> bool:
    """Return whether a few poses of one clip come near those of the other at any delay; a tenth of
    the work of `distance`."""
    lags = np.array(_lags(config))
    overlap = np.minimum(len(one), len(two) + lags) - np.maximum(lags, 0)
    lags = lags[overlap >= _least(one, two, config)]
    step = min(round(config.rate), len(one) // ROUGH_POSES)
    rows = np.arange(0, len(one), max(1, step))
    at = rows[:, None] - lags
    inside = (at >= 0) & (at < len(two))
    apart = np.linalg.norm(one[rows, None] - two[np.clip(at, 0, len(two) - 1)], axis=-1).mean(-1)
    seen = inside & ~np.isnan(apart)
    count = seen.sum(0)
    near = np.where(seen, apart, 0.0).sum(0) <= ROUGH_FACTOR * config.distance * count
    return bool((near | (count < ROUGH_LEAST)).any())


def _least(one: Poses, two: Poses, config: DuplicateConfig) -> int:
    """Return how many poses both clips must show."""
    return max(2, int(config.overlap * min(len(one), len(two))))


def _lags(config: DuplicateConfig) -> range:
    """Return the delays that are compared, poses."""
    longest = int(config.lag_s * config.rate)
    return range(-longest, longest + 1)


def _at(one: Poses, two: Poses, lag: int, least: int) -> float:
    """Return the mean distance when the second clip starts `lag` poses after the first."""
    begin, end = max(0, lag), min(len(one), len(two) + lag)
    if end - begin < least:
        return np.inf
    apart = np.linalg.norm(one[begin:end] - two[begin - lag : end - lag], axis=-1)
    seen = ~np.isnan(apart).any(1)
    return float(apart[seen].mean()) if seen.sum() >= least else np.inf
