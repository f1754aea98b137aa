"""Advice for filming a clip again: kinds with figures; the words are made last.

Derived from the clip alone, that is from the landmarks and what was measured beside them. The same
advice is given by `mocap`, by `dance` and by the page of a run.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from robojackson.clips.people.camera_path import stray_of
from robojackson.clips.people.person_extent import BODY, heights_px, indices
from robojackson.motion.landmark_track import LandmarkTrack, evenly

Kind = Literal[
    "frame_rate", "too_short", "person_small", "body_outside", "person_missing", "people",
    "camera_moves", "dark", "blurred", "head_down",
]  # fmt: skip
HALF_TURN = "if the picture is upside down, turn it: ffmpeg -i IN -vf hflip,vflip OUT.mp4"
QUARTER_TURN = "if the picture is on its side, turn it: ffmpeg -i IN -vf transpose=1 OUT.mp4 (or 2)"
LIMITS: Mapping[Kind, float] = {
    "frame_rate": 20.0,
    "too_short": 2.0,
    "person_small": 140.0,
    "body_outside": 0.1,
    "person_missing": 0.9,
    "people": 1.0,
    "camera_moves": 0.02,
    "dark": 0.2,
    "blurred": 0.14,
    "head_down": 0.5,
}
"""Where advice begins: frames a second, seconds, pixels, share of the frames with a person, share
of all frames, a count, share of the image's diagonal, grey level 0..1, share of fine detail, share
of the frames with a person. Under two seconds are too short to evaluate; the pixels are those of a
search's filter; grey level and detail are half of what the bundled clips have at the worst."""
SHORT_GAP_S = 0.25
"""A gap that motion capture fills without harm."""
AT_MOST: tuple[Kind, ...] = ("body_outside", "people", "camera_moves", "head_down")
"""Figures that are advised against above their limit; the others below it."""


@dataclass(frozen=True)
class Advice:
    """One piece of advice.

    Attributes:
        kind: Subject of the advice.
        value: The figure that was measured, in the unit of its limit.
        limit: Figure from which on the advice is given.
        range_s: First and last moment of the part that is good, seconds from the first frame.
    """

    kind: Kind
    value: float
    limit: float
    range_s: tuple[float, float] | None = None

    def __str__(self) -> str:
        return _WORDS[self.kind](self)

    def later(self, begin_s: float) -> "Advice":
        """Return the same about a video of which the clip is the part from a moment on, seconds."""
        if self.range_s is None:
            return self
        first, last = self.range_s
        return replace(self, range_s=(begin_s + first, begin_s + last))

    @property
    def record(self) -> dict[str, object]:
        """Kind, figures and words, for JSON."""
        figures = {"kind": self.kind, "value": self.value, "limit": self.limit}
        part = {} if self.range_s is None else {"range_s": list(self.range_s)}
        return {**figures, "words": str(self), **part}


def advise(track: LandmarkTrack, begin_s: float = 0.0) -> tuple[Advice, ...]:
    """Return what to do better, the gravest kinds of a list by hand first; nothing for a good
    clip.

    Args:
        begin_s: Where the clip begins in the video that the user has, seconds.
    """
    even = evenly(track)
    ranges = {"person_missing": visible_range(even)}
    return tuple(
        Advice(kind, value, LIMITS[kind], ranges.get(kind)).later(begin_s)
        for kind, value in _figures(track, even.detected).items()
        if value is not None and (value > LIMITS[kind] if kind in AT_MOST else value < LIMITS[kind])
    )


def _figures(track: LandmarkTrack, evenly_seen: np.ndarray) -> dict[Kind, float | None]:
    """Return every figure that advice is about; None where it was not measured."""
    seen = track.detected
    height = float(np.median(heights_px(track)[seen])) if seen.any() else None
    moved = None if track.to_first is None else stray_of(track.to_first, track.width, track.height)
    return {
        "head_down": _head_down(track) if seen.any() else None,
        "person_missing": float(evenly_seen.mean()) if len(track) else None,
        "people": float(track.people),
        "body_outside": _outside(track) if seen.any() else None,
        "person_small": height,
        "frame_rate": track.fps,
        "too_short": len(track) / track.fps,
        "camera_moves": moved,
        "dark": track.brightness,
        "blurred": track.sharpness,
    }


def visible_range(track: LandmarkTrack) -> tuple[float, float] | None:
    """Return the longest part in which the person is never missing for long, seconds; None where it
    is too short for a dance."""
    seen = np.flatnonzero(track.detected)
    if not len(seen):
        return None
    parts = np.split(seen, np.flatnonzero(np.diff(seen) > SHORT_GAP_S * track.fps) + 1)
    first, last = max(((part[0], part[-1]) for part in parts), key=lambda each: each[1] - each[0])
    begin, end = float(track.times[first]), float(track.times[last])
    return (begin, end) if end - begin >= LIMITS["too_short"] else None


def _outside(track: LandmarkTrack) -> float:
    """Return the share of the frames with a person in which head, trunk or legs leave the image."""
    xy = track.landmarks[track.detected][:, indices(BODY), :2]
    return float(((xy < 0.0) | (xy > 1.0)).any((1, 2)).mean())


def _head_down(track: LandmarkTrack) -> float:
    """Return the share of the frames with a person whose ankles are above the shoulders in the
    picture."""
    heights = track.landmarks[track.detected][..., 1]
    ankles, shoulders = (
        heights[:, indices((f"left_{name}", f"right_{name}"))].mean(1)
        for name in ("ankle", "shoulder")
    )
    return float((ankles < shoulders).mean())


def _in_sight(range_s: tuple[float, float] | None) -> str:
    return "" if range_s is None else f" (in sight from {range_s[0]:.1f} to {range_s[1]:.1f} s)"


_WORDS: Mapping[Kind, Callable[[Advice], str]] = {
    "frame_rate": lambda a: f"{a.value:.3g} frames a second: film at 30",
    "too_short": lambda a: f"{a.value:.1f} s long: film at least {a.limit:g} s",
    "person_small": lambda a: (
        f"the person is {a.value:.0f} pixels tall: go nearer, at least {a.limit:.0f} are needed"
    ),
    "body_outside": lambda a: (
        f"the body leaves the picture in {a.value:.0%} of the frames: step back, or turn the "
        "camera upright"
    ),
    "person_missing": lambda a: (
        f"the person is detected in {a.value:.0%} of the frames: choose a range with --start and "
        f"--end{_in_sight(a.range_s)}, or film without anything in between"
    ),
    "people": lambda a: (
        f"{a.value:.0f} people in view: film one alone, or choose with --person (mocap --people "
        "lists them)"
    ),
    "camera_moves": lambda a: (
        f"the camera moves by {a.value:.0%} of the picture: put it on something that stands"
    ),
    "dark": lambda a: f"the person is dark, {a.value:.0%} of full light: switch on more light",
    "blurred": lambda a: (
        f"the picture is blurred, {a.value:.0%} of its contrast is detail: clean the lens, focus "
        "on the dancer, use more light"
    ),
    "head_down": lambda a: f"the person is head down in {a.value:.0%} of the frames; {HALF_TURN}",
}
