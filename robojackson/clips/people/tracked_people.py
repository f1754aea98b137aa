"""All people of a clip: how large, where and when; number 1 is the largest steady person."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from robojackson.clips.people.identity import IdentityConfig, identify
from robojackson.clips.people.person_detection import (
    PersonDetection,
    PersonDetectionConfig,
    detect_people,
)
from robojackson.clips.people.person_extent import place_of, stature, trunk
from robojackson.clips.pose_detector import still_landmarker
from robojackson.clips.video import VideoInfo, timed_frames

SCOUT = "lite"
"""Size of the pose model that looks for people; the dancer is then followed with a better one."""
LEFT, RIGHT = 0.4, 0.6
NEAR = 0.5
"""Body heights; a person seen nearer than this to an earlier place has left it."""


@dataclass(frozen=True)
class Person:
    """One person of a clip.

    Attributes:
        number: 1 is the largest steady person.
        height_px: Median size in the image, pixels.
        detected_share: Share of the frames in which the person is detected.
        from_s, to_s: First and last detection, seconds.
        place: Median place in the image from the left, 0..1.
    """

    number: int
    height_px: float
    detected_share: float
    from_s: float
    to_s: float
    place: float

    def later(self, begin_s: float) -> "Person":
        """Return the same of a video of which the clip is the part from a moment on, seconds."""
        return replace(self, from_s=begin_s + self.from_s, to_s=begin_s + self.to_s)

    def __str__(self) -> str:
        side = "left" if self.place < LEFT else "right" if self.place > RIGHT else "middle"
        return (
            f"{self.number} ({self.height_px:.0f} px tall, {side}, "
            f"seen in {self.detected_share:.0%}, {self.from_s:.1f}-{self.to_s:.1f} s)"
        )


@dataclass(frozen=True)
class TrackedPeople:
    """All people of a clip.

    Attributes:
        rows: One track a person, number 1 first; NaN where not detected.
        time_s: When each frame was taken, seconds.
        info: The file; texts have the moments of the video of which it is a range.
    """

    rows: list[Float[np.ndarray, "T 33 7"]]
    time_s: Float[np.ndarray, " T"]
    info: VideoInfo

    @property
    def people(self) -> list[Person]:
        """The people, in order of their numbers."""
        return [self._person(number, rows) for number, rows in enumerate(self.rows, start=1)]

    def __str__(self) -> str:
        listed = "; ".join(str(person.later(self.info.begin_s)) for person in self.people)
        return listed or "no person is visible for long enough"

    def _person(self, number: int, rows: np.ndarray) -> Person:
        seen = np.flatnonzero(~np.isnan(rows[:, 0, 0]))
        points = rows[seen, :, :2] * (self.info.width, self.info.height)
        return Person(
            number=number,
            height_px=float(np.median(stature(points))),
            detected_share=len(seen) / len(rows),
            from_s=float(self.time_s[seen[0]]),
            to_s=float(self.time_s[seen[-1]]),
            place=float(np.median(rows[seen][:, trunk(), 0])),
        )


def track_people(
    path: Path,
    info: VideoInfo,
    detection: PersonDetectionConfig,
    identity: IdentityConfig,
    progress: Callable[[int, int], None] | None = None,
) -> TrackedPeople:
    """Return all people in every frame, with their identities."""
    found: list[list[PersonDetection]] = []
    times: list[float] = []
    memory, search_s = Memory(), 0.0
    with still_landmarker(SCOUT) as landmarker:
        frames = timed_frames(path, short_side=detection.short_side)
        for index, (time_s, image) in enumerate(frames):
            everywhere = time_s >= search_s
            if everywhere:
                search_s = time_s + detection.search_every_s
            expected = memory.of(time_s, detection.memory_s)
            found.append(detect_people(image, landmarker, detection, expected, everywhere))
            memory.add(time_s, found[-1], info)
            times.append(time_s)
            if progress:
                progress(index + 1, info.frames)
    when = np.array(times)
    rows = identify(found, when, (info.width, info.height), identity)
    return TrackedPeople(rows, when, info)


class Memory:
    """Where people were seen last."""

    def __init__(self) -> None:
        self._seen: list[tuple[float, np.ndarray]] = []

    def of(self, time_s: float, memory_s: float) -> list[np.ndarray]:
        """Return the rows of those who were seen shortly before a moment, and forget the others."""
        self._seen = [each for each in self._seen if time_s - each[0] <= memory_s]
        return [row for _, row in self._seen]

    def add(self, time_s: float, people: list[PersonDetection], info: VideoInfo) -> None:
        """Remember people of a frame; who was seen nearby before is the same for this purpose."""
        size = (info.width, info.height)
        now = [(time_s, person.row) for person in people]
        for _, row in now:
            place, tall = place_of(row, size)
            self._seen = [
                each
                for each in self._seen
                if np.linalg.norm(place_of(each[1], size)[0] - place) > NEAR * tall
            ]
        self._seen += now
