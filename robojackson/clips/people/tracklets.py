"""Stretches of frames in which one person was followed without ambiguity.

From one frame to the next, people are matched by the Hungarian method. Where they touch (two claim
one detection, one vanishes or appears beside another) the tracklets of all of them end; what
follows beside a person who vanished may be either of the two, and is marked. Pixels and seconds.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from pydantic import Field

from robojackson.clips.people.person_detection import PersonDetection
from robojackson.clips.people.person_extent import stature, trunk
from robojackson.config import config_dataclass

LEAST_PAUSE = 1.5
"""Gap that a tracklet outlives at least, frames: one may be longer than the pause."""


@config_dataclass
class TrackletConfig:
    """Configuration of tracklets.

    Attributes:
        step: Distance of the trunk from one frame to the next, body heights.
        step_speed: The distance as a speed, body heights a second: it counts at low frame rates.
        growth: Change of size from one frame to the next, ratio, that counts half of such a step.
        crowding: People whose trunks are nearer than this touch, body heights.
        pause_s: A tracklet outlives so long a gap, seconds.
    """

    step: float = Field(default=0.12, gt=0)
    step_speed: float = Field(default=2.5, gt=0)
    growth: float = Field(default=1.6, gt=1)
    crowding: float = Field(default=0.5, gt=0)
    pause_s: float = Field(default=0.1, ge=0)


@dataclass
class Tracklet:
    """A stretch of frames in which one person was followed.

    Attributes:
        frames: Numbers of the frames.
        time_s: Times of the frames, seconds.
        rows: Landmarks.
        place: Middle of the trunk, pixels.
        tall: Stature, pixels.
        colours: Colours.
        blended: Whether it may be either of two people detected as one.
    """

    frames: list[int] = field(default_factory=list)
    time_s: list[float] = field(default_factory=list)
    rows: list[np.ndarray] = field(default_factory=list)
    place: list[np.ndarray] = field(default_factory=list)
    tall: list[float] = field(default_factory=list)
    colours: list[np.ndarray] = field(default_factory=list)
    blended: bool = False

    def extend(self, other: "Tracklet") -> None:
        """Go on with a single detection."""
        for name in ("frames", "time_s", "rows", "place", "tall", "colours"):
            getattr(self, name).extend(getattr(other, name))

    def add(self, frame: int, time_s: float, seen: PersonDetection, size: tuple[int, int]) -> None:
        """Add a detection of a frame."""
        points = seen.row[:, :2] * size
        self.frames.append(frame)
        self.time_s.append(time_s)
        self.rows.append(seen.row)
        self.place.append(points[trunk()].mean(0))
        self.tall.append(max(float(stature(points)), 1.0))
        self.colours.append(seen.colours)


def find_tracklets(
    frames: Sequence[Sequence[PersonDetection]],
    time_s: Float[np.ndarray, " T"],
    size: tuple[int, int],
    config: TrackletConfig,
) -> list[Tracklet]:
    """Return the unambiguous stretches, and those of two people detected as one."""
    done: list[Tracklet] = []
    alive: list[Tracklet] = []
    period_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    pause_s = max(config.pause_s, LEAST_PAUSE * period_s) + 1e-6
    for index, detections in enumerate(frames):
        now = float(time_s[index])
        done += [p for p in alive if now - p.time_s[-1] > pause_s]
        alive = [p for p in alive if now - p.time_s[-1] <= pause_s]
        seen = [_tracklet_of(index, now, detection, size) for detection in detections]
        resumes = _claims(alive, seen, config)
        ended, blended = _touches(alive, seen, resumes, config)
        for old, new in resumes.items():
            if old in ended:
                seen[new].blended = new in blended
            else:
                alive[old].extend(seen[new])
        taken = {new for old, new in resumes.items() if old not in ended}
        done += [p for old, p in enumerate(alive) if old in ended]
        alive = [p for old, p in enumerate(alive) if old not in ended]
        alive += [p for new, p in enumerate(seen) if new not in taken]
    return done + alive


def _tracklet_of(index: int, now: float, seen: PersonDetection, size: tuple[int, int]) -> Tracklet:
    points = seen.row[:, :2] * size
    tall = max(float(stature(points)), 1.0)
    return Tracklet([index], [now], [seen.row], [points[trunk()].mean(0)], [tall], [seen.colours])


def _claims(
    alive: Sequence[Tracklet], seen: Sequence[Tracklet], config: TrackletConfig
) -> dict[int, int]:
    """Return which tracklet continues with which detection, with the least total change."""
    from scipy.optimize import linear_sum_assignment

    if not alive or not seen:
        return {}
    far = np.array([[_step(a, b, config) for b in seen] for a in alive])
    pairs = zip(*linear_sum_assignment(np.minimum(far, 2.0)), strict=True)
    return {int(a): int(b) for a, b in pairs if far[a, b] < 1.0}


def _touches(
    alive: Sequence[Tracklet],
    seen: Sequence[Tracklet],
    resumes: dict[int, int],
    config: TrackletConfig,
) -> tuple[set[int], set[int]]:
    """Return the tracklets that end because people touch, and detections that may be either of two.

    Beside a person who just vanished a detection may be theirs; beside one who just appeared both
    are seen apart again.
    """
    ended: set[int] = set()
    blended: set[int] = set()
    lost = [i for i in range(len(alive)) if i not in resumes]
    fresh = [j for j in range(len(seen)) if j not in resumes.values()]
    for old, new in resumes.items():
        besides = [i for i in lost if _near(alive[i], alive[old], config)]
        if besides:
            ended |= {old, *besides}
            blended.add(new)
        if any(_near(seen[j], seen[new], config) for j in fresh):
            ended.add(old)
            blended.discard(new)
        rivals = [i for i in resumes if i != old and _step(alive[i], seen[new], config) < 1.0]
        if rivals:
            ended |= {old, *rivals}
    return ended, blended


def _near(one: Tracklet, other: Tracklet, config: TrackletConfig) -> bool:
    tall = max(one.tall[-1], other.tall[-1])
    return bool(np.linalg.norm(one.place[-1] - other.place[-1]) < config.crowding * tall)


def _step(before: Tracklet, after: Tracklet, config: TrackletConfig) -> float:
    """Return how far a detection is from a tracklet, 1 is as far as it may be."""
    away_s = after.time_s[0] - before.time_s[-1]
    tall = max(before.tall[-1], after.tall[0])
    moved = np.linalg.norm(after.place[0] - before.place[-1]) / tall
    grown = abs(np.log(after.tall[0] / before.tall[-1])) / np.log(config.growth)
    return float(moved / max(config.step, config.step_speed * away_s) + 0.5 * grown)
