"""A second pass over stretches in which the detector may have lost limbs, in reverse order.

BlazePose looks for a person where he was in the frame before. A body that turns over, or legs that
swing out of that crop, are lost at one moment and found again later; tracked in reverse order, the
same failure begins at its other end and, as a rule, ends before it. Between both passes each frame
takes the one that makes the steadier path, where they are apart. Turned pictures show no more than
upright ones (`docs/benchmarks_mocap.md`). Positions in pixels, distances in body heights.
"""

from collections.abc import Callable, Iterable, Iterator

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from pydantic import Field
from scipy.ndimage import binary_dilation, binary_propagation

from robojackson.body.feet import stretches
from robojackson.clips.people.person_extent import MIRROR, POINTS, stature, trunk
from robojackson.clips.pose_detector import video_landmarker
from robojackson.config import config_dataclass

SHORT_SIDE = 540
"""Short side of the pictures of this pass, pixels: a stretch is held in memory."""
LONGEST = 150
"""Frames of a stretch that are tracked at once; longer ones in parts."""
UNSEEN = 0.15
"""What a frame without a person costs on a path, and a step from or to one, body heights."""
PREFERENCE = 0.002
"""What a frame of the second pass costs on a path where both are the same, body heights."""
ASTRAY = 1.0
"""Body heights; a person of the second pass further than this from the first one's is another."""
JOINTS = list(POINTS.values())


@config_dataclass
class ReversePassConfig:
    """When a clip is tracked in reverse order, too.

    Attributes:
        enabled: Whether doubtful stretches are tracked in reverse order.
        jump: Mean step of the joints from frame to frame that is suspect, body heights.
        tilt_deg: Tilt of the trunk in the picture that is suspect, degrees.
        reach_s: Time on each side of suspect frames that is tracked with them, seconds.
        apart: Mean distance of the joints of both passes from which they differ, body heights.
        near: Distance down to which the frames beside such ones belong to them, body heights.
    """

    enabled: bool = True
    jump: float = Field(default=0.15, gt=0)
    tilt_deg: float = Field(default=60.0, gt=0, le=180)
    reach_s: float = Field(default=1.0, ge=0, le=5)
    apart: float = Field(default=0.15, gt=0)
    near: float = Field(default=0.05, gt=0)


def track_in_reverse(
    images: Iterable[UInt8[np.ndarray, "H W 3"]],
    fps: float,
    size: tuple[int, int],
    model: str,
    rows: Float[np.ndarray, "T 33 7"],
    config: ReversePassConfig,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[Float[np.ndarray, "T 33 7"], int]:
    """Return the better rows of both passes, and how many are of the second one.

    Args:
        images: The pictures of all frames, RGB, of any size; not read where nothing is suspect.
        fps: Frames a second.
        size: Width and height of the pictures of the video, pixels.
        model: lite, full or heavy.
        rows: What the detector found in the order of the clip.
        config: When and how to look.
        progress: Called with (frames done, frames in all).
    """
    if not config.enabled or not (doubtful := suspect(rows, size, config)).any():
        return rows, 0
    reach = min(round(config.reach_s * fps), LONGEST)
    near = binary_dilation(doubtful, iterations=reach) if reach else doubtful
    second = np.array(rows)
    for part, found in _second_pass(images, fps, model, parts(near, reach)):
        second[part] = found
        if progress:
            progress(int(len(rows) * near[: part.stop].sum() / near.sum()), len(rows))
    better = np.zeros(len(rows), bool)
    for start, end in stretches(near):
        whole = slice(max(start - 1, 0), end + 1)  # begins and ends in the first pass
        better[whole] |= choose(rows[whole], second[whole], size, config)
    return np.where(better[:, None, None], second, rows), int(better.sum())


def suspect(
    rows: Float[np.ndarray, "T 33 7"], size: tuple[int, int], config: ReversePassConfig
) -> Bool[np.ndarray, " T"]:
    """Return frames in which joints jump, no person is seen between others, or the trunk lies or
    hangs."""
    seen = ~np.isnan(rows[:, 0, 0])
    if seen.sum() < 2:
        return np.zeros(len(rows), bool)
    points = rows[..., :2] * size
    step = np.linalg.norm(np.diff(points[:, JOINTS], axis=0), axis=-1).mean(1) / _tall(points)
    found = np.zeros(len(rows), bool)
    found[1:] = np.nan_to_num(step) > config.jump
    shoulders, hips = (points[:, pair].mean(1) for pair in (trunk()[:2], trunk()[2:]))
    across, up = np.abs(shoulders[:, 0] - hips[:, 0]), hips[:, 1] - shoulders[:, 1]
    with np.errstate(invalid="ignore"):
        found |= np.degrees(np.arctan2(across, up)) > config.tilt_deg
    first, last = np.flatnonzero(seen)[[0, -1]]
    found[first:last] |= ~seen[first:last]
    return found


def parts(frames: Bool[np.ndarray, " T"], lead: int) -> list[tuple[slice, int]]:
    """Return the stretches of frames, long ones in parts, and the frame before which tracking in
    reverse begins: up to `lead` after a part's end, within its stretch."""
    return [
        (slice(begin, min(begin + LONGEST, end)), min(begin + LONGEST + lead, end))
        for start, end in stretches(frames)
        for begin in range(start, end, LONGEST)
    ]


def choose(
    first: Float[np.ndarray, "T 33 7"],
    second: Float[np.ndarray, "T 33 7"],
    size: tuple[int, int],
    config: ReversePassConfig,
) -> Bool[np.ndarray, " T"]:
    """Return the frames that the second pass shows better: where it is apart from the first by
    more than an exchange of sides, which is put right later, and the path with the least motion
    from frame to frame goes through it."""
    points = np.stack([rows[:, JOINTS, :2] * size for rows in (first, second)])
    seen = ~np.isnan(points[..., 0, 0])
    if not seen[0].any():
        return np.asarray(seen[1])
    tall = _tall(first[..., :2] * size)
    seen[1] &= _near_first(first, second, size, ASTRAY * tall)
    exchanged = second[:, list(MIRROR)][:, JOINTS, :2] * size
    apart = np.minimum(*(_distance(points[0], other) for other in (points[1], exchanged))) / tall
    apart = np.where(seen.all(0), apart, np.where(seen.any(0), np.inf, 0.0))
    differ = binary_propagation(apart > config.apart, mask=apart > config.near)
    path = steadiest(points / tall, seen, PREFERENCE * ~differ)
    return np.asarray(differ & (path == 1) & seen[1])


def _near_first(
    first: Float[np.ndarray, "T 33 7"],
    second: Float[np.ndarray, "T 33 7"],
    size: tuple[int, int],
    reach: float,
) -> Bool[np.ndarray, " T"]:
    """Return frames in which the second pass has the trunk near that of the first one, which moves
    straight where no person is seen."""
    places = [(rows[:, trunk(), :2] * size).mean(1) for rows in (first, second)]
    frames, seen = np.arange(len(first)), ~np.isnan(places[0][:, 0])
    course = np.stack([np.interp(frames, frames[seen], axis[seen]) for axis in places[0].T], -1)
    return np.asarray(np.linalg.norm(places[1] - course, axis=-1) <= reach)


def steadiest(
    points: Float[np.ndarray, "2 T K 2"],
    seen: Bool[np.ndarray, "2 T"],
    prefer: Float[np.ndarray, " T"],
) -> Int[np.ndarray, " T"]:
    """Return for each frame the pass, 0 or 1, through which the path with the least motion goes
    (dynamic programming).

    Args:
        points: Joints of both passes, body heights.
        seen: Whether a person was detected.
        prefer: What the second pass costs more, body heights.
    """
    count = points.shape[1]
    standing = np.where(seen, 0.0, UNSEEN).T
    standing[:, 1] += prefer
    came, cost = np.zeros((count, 2), int), standing[0]
    for frame in range(1, count):
        step = np.full((2, 2), UNSEEN)
        for before in range(2):
            for after in range(2):
                if seen[before, frame - 1] and seen[after, frame]:
                    moved = points[after, frame] - points[before, frame - 1]
                    step[before, after] = np.linalg.norm(moved, axis=-1).mean()
        total = cost[:, None] + step
        came[frame] = total.argmin(0)
        cost = total.min(0) + standing[frame]
    path = np.empty(count, int)
    path[-1] = cost.argmin()
    for frame in range(count - 1, 0, -1):
        path[frame - 1] = came[frame, path[frame]]
    return path


def _distance(one: Float[np.ndarray, "T K 2"], other: Float[np.ndarray, "T K 2"]) -> np.ndarray:
    return np.asarray(np.linalg.norm(one - other, axis=-1).mean(1))


def _tall(points: Float[np.ndarray, "T 33 2"]) -> float:
    seen = ~np.isnan(points[:, 0, 0])
    return float(np.median(stature(points[seen])))


def _second_pass(
    images: Iterable[UInt8[np.ndarray, "H W 3"]],
    fps: float,
    model: str,
    chosen: list[tuple[slice, int]],
) -> Iterator[tuple[slice, Float[np.ndarray, "T 33 7"]]]:
    """Yield each part with what the detector finds in it in reverse order."""
    frames = enumerate(images)
    held: dict[int, UInt8[np.ndarray, "H W 3"]] = {}
    absent = np.full((33, 7), np.nan)
    for part, begin in chosen:
        held = {index: image for index, image in held.items() if index >= part.start}
        if max(held, default=-1) < begin - 1:
            for index, image in frames:
                if index >= part.start:
                    held[index] = image
                if index == begin - 1:
                    break
        with video_landmarker(model) as detect_frame:
            found = {
                index: detect_frame(held[index], place / fps)
                for place, index in enumerate(sorted(held, reverse=True))
            }
        yield part, np.array([found.get(i, absent) for i in range(part.start, part.stop)])
