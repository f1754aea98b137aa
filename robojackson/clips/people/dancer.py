"""The dancer of a clip in which there may be others: one person, the same from first to last frame.

A clip of one person is processed once. Where a few frames show another, all people are detected in
every frame (`person_detection`) and identified (`identity`); then the dancer is followed as if
alone, with all others painted over, because the detector is best on the person it follows, and
inside windows where he is small in the picture. The largest steady person is number 1 and danced by
default.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, UInt8
from pydantic import Field

from robojackson.clips.people.close_up import CloseUpConfig
from robojackson.clips.people.identity import IdentityConfig
from robojackson.clips.people.person_count import People, PeopleConfig
from robojackson.clips.people.person_detection import PersonDetectionConfig
from robojackson.clips.people.person_extent import stature, trunk
from robojackson.clips.people.person_silhouette import paint, silhouette
from robojackson.clips.people.person_windows import Box, detect_in_windows, windows
from robojackson.clips.people.reverse_pass import ReversePassConfig
from robojackson.clips.people.second_look import look_again
from robojackson.clips.people.tracked_people import SCOUT, TrackedPeople, track_people
from robojackson.clips.pose_detector import (
    SHORT_SIDE,
    Watcher,
    detect,
    still_landmarker,
    track_of,
)
from robojackson.clips.video import VideoInfo
from robojackson.config import config_dataclass
from robojackson.errors import NoPersonFound
from robojackson.motion.landmark_track import LandmarkTrack

Progress = Callable[[int, int], None]
STAYS_AMONG_OTHERS = 0.15
"""The `stays` of windows that are small, so as to hold no others."""


@config_dataclass
class DancerConfig:
    """Configuration of following one dancer among others.

    Attributes:
        number: The person to follow: 1 is the largest steady person, and so is None.
        close_up: Configuration of looking closely at a person who is far away.
        reverse: Configuration of tracking a person who is alone in reverse order, too.
        scouts: The few frames in which other people are looked for.
        detection, identity: Configurations of detecting and identifying all people in every frame.
        astray: Body heights; a detection further than this from the expected place is another's.
        crowding: People nearer than this hide one another, body heights.
        window: Side of the window in which a small person is followed among others, body heights.
        longest_gap_s: Longest gap in which the person is looked for, seconds.
    """

    number: int | None = Field(default=None, ge=1)
    close_up: CloseUpConfig = Field(default_factory=CloseUpConfig)
    reverse: ReversePassConfig = Field(default_factory=ReversePassConfig)
    scouts: PeopleConfig = Field(default_factory=PeopleConfig)
    detection: PersonDetectionConfig = Field(default_factory=PersonDetectionConfig)
    identity: IdentityConfig = Field(default_factory=IdentityConfig)
    astray: float = Field(default=0.3, gt=0)
    crowding: float = Field(default=0.5, gt=0)
    window: float = Field(default=1.8, ge=1.5)
    longest_gap_s: float = Field(default=1.0, ge=0)


def track_dancer(
    path: Path,
    info: VideoInfo,
    size: str,
    config: DancerConfig,
    progress: Progress | None = None,
    watch: Watcher | None = None,
) -> LandmarkTrack:
    """Return the landmarks of one person, NaN rows where they are not visible.

    Args:
        path: Video file.
        info: What `probe` found in it.
        size: lite, full or heavy.
        config: Which person to follow, and how.
        progress: Called with (frames done, frames in all); others in view make it several passes.
        watch: Called with every frame and the landmarks of the first pass: the track's where no
            further one was made.
    Raises:
        NoPersonFound: there is no person of that number; the message lists the people.
        MissingDependency: no model bundle, or no EGL and GLES libraries.
    """
    if config.number is None or config.number == 1:
        single, others = _scouted(path, info, size, config, progress, watch)
        if not others:
            later = _shifted(progress, info.frames, 1, 2)
            return look_again(path, info, size, single, config.close_up, config.reverse, later)
    passes = 3 if config.number in (None, 1) else 2
    later = _shifted(progress, info.frames, passes - 2, passes)
    cast = track_people(path, info, config.detection, config.identity, later)
    if len(cast.rows) < 2 and config.number in (None, 1):  # the second one was a mistake
        later = _shifted(progress, info.frames, passes - 1, passes)
        return look_again(path, info, size, single, config.close_up, config.reverse, later)
    number = config.number or 1
    if number > len(cast.rows):
        raise NoPersonFound(f"there is no person {number} among {len(cast.rows)}: {cast}", path)
    rows = _followed(
        path, cast, number - 1, size, config, _shifted(progress, info.frames, passes - 1, passes)
    )
    notes = (f"{len(cast.rows)} people in view, this is person {number}: {cast}",)
    return replace(track_of(rows, cast.time_s, info, number, notes), people=len(cast.rows))


def _scouted(
    path: Path,
    info: VideoInfo,
    size: str,
    config: DancerConfig,
    progress: Progress | None,
    also: Watcher | None,
) -> tuple[LandmarkTrack, bool]:
    """Return the track of a person who is alone, and whether another person was detected in a few
    frames."""
    with still_landmarker(SCOUT) as landmarker:
        scouts = People(info.frames, info.fps, landmarker, config.scouts)

        def watch(index: int, image: np.ndarray, row: np.ndarray) -> None:
            scouts.add_frame(index, image, row[:, :2])
            if also:
                also(index, image, row)

        track = detect(path, info, size, progress, watch)
    return track, max(scouts.counts, default=0) > 1


def _followed(
    path: Path,
    cast: TrackedPeople,
    chosen: int,
    size: str,
    config: DancerConfig,
    progress: Progress | None,
) -> Float[np.ndarray, "T 33 7"]:
    """Return rows of one person, the others painted over; what is known of everybody where that
    goes astray."""
    known = cast.rows[chosen]
    others = np.array([rows for number, rows in enumerate(cast.rows) if number != chosen])
    info, size_px = cast.info, (cast.info.width, cast.info.height)
    needed = near_known(known, cast.time_s, config.longest_gap_s)

    def alone(index: int, image: np.ndarray) -> np.ndarray | None:
        if not needed[index]:
            return None
        return mask_others(image, known[index], others[:, index], config.detection.limb_width)

    course, tall = _course(known, cast.time_s, size_px)
    side = config.window * float(np.median(tall))
    boxes: Iterable[tuple[int, Box]] = [(len(known), (0, 0, *size_px))]
    is_small = side < min(size_px)
    if is_small:
        boxes = windows(course, side, size_px[::-1], STAYS_AMONG_OTHERS)
    short_side = None if is_small else SHORT_SIDE
    found = detect_in_windows(path, info, size, boxes, alone, progress, short_side)
    return checked(found, cast.rows, chosen, cast.time_s, size_px, config)


def near_known(
    known: Float[np.ndarray, "T 33 7"], time_s: Float[np.ndarray, " T"], gap_s: float
) -> Bool[np.ndarray, " T"]:
    """Return the frames that are near enough to one in which the person was detected."""
    seen = time_s[~np.isnan(known[:, 0, 0])]
    return np.asarray(np.abs(time_s[:, None] - seen).min(1) <= gap_s)


def mask_others(
    image: UInt8[np.ndarray, "H W 3"],
    person: Float[np.ndarray, "33 7"],
    others: Float[np.ndarray, "P 33 7"],
    limb_width: float,
) -> UInt8[np.ndarray, "H W 3"]:
    """Return the picture with all others painted over where they do not cover the person."""
    height, width = image.shape[:2]
    clear = image.copy()
    kept = np.zeros((height, width), bool)
    if not np.isnan(person).any():
        kept = silhouette(person[:, :2], width, height, limb_width)
    for other in others:
        if not np.isnan(other).any():
            paint(clear, silhouette(other[:, :2], width, height, limb_width) & ~kept)
    return clear


def checked(
    found: Float[np.ndarray, "T 33 7"],
    everybody: list[Float[np.ndarray, "T 33 7"]],
    chosen: int,
    time_s: Float[np.ndarray, " T"],
    size: tuple[int, int],
    config: DancerConfig,
) -> Float[np.ndarray, "T 33 7"]:
    """Return the detections of a person, the known position where one is astray, NaN where neither
    exists.

    In a gap the person may be found on the line between the known positions before and after, if no
    other person's line comes near.
    """
    known = everybody[chosen]
    expected, tall = _course(known, time_s, size)
    places = (found[:, trunk(), :2] * size).mean(1)
    off = np.linalg.norm(places - expected, axis=-1) / tall
    trusted = off <= config.astray
    for number, other in enumerate(everybody):
        if number != chosen:
            rival = _course(other, time_s, size)[0]
            apart = np.linalg.norm(rival - expected, axis=-1) / tall
            trusted &= off <= np.linalg.norm(rival - places, axis=-1) / tall
            trusted &= ~np.isnan(known[:, 0, 0]) | (apart > config.crowding)
    return np.where(trusted[:, None, None], found, known)


def _course(
    rows: Float[np.ndarray, "T 33 7"], time_s: Float[np.ndarray, " T"], size: tuple[int, int]
) -> tuple[Float[np.ndarray, "T 2"], Float[np.ndarray, " T"]]:
    """Place of the trunk and stature in every frame, pixels, straight through gaps."""
    seen = ~np.isnan(rows[:, 0, 0])
    points = rows[seen, :, :2] * size
    places = points[:, trunk()].mean(1)
    course = np.stack([np.interp(time_s, time_s[seen], axis) for axis in places.T], -1)
    return course, np.interp(time_s, time_s[seen], stature(points))


def _shifted(progress: Progress | None, frames: int, before: int, passes: int) -> Progress | None:
    """Return the progress of one pass over the frames, `before` passes after the first."""
    if progress is None:
        return None
    return lambda done, total: progress(before * frames + done, passes * frames)
