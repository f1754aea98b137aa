"""Reasons against a video: a kind and its figures; the words are made from them last."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

Kind = Literal[
    "live",
    "too_long",
    "found_twice",
    "known",
    "less_watched",
    "further_down",
    "no_person",
    "person_missing",
    "body_cut_off",
    "too_short",
    "person_small",
    "camera_moves",
    "slideshow",
    "still_picture",
    "people",
    "cuts",
    "drawing",
    "copy",
    "mirrored_copy",
]


@dataclass(frozen=True)
class Rejection:
    """One reason against a video.

    Attributes:
        kind: Reason of the rejection.
        value: The figure that was measured: seconds, pixels, a count or a share, by the kind.
        limit: What the configuration allows, in the same unit; None where it names no figure.
        other: Name or title of the video that this one is a copy of.
    """

    kind: Kind
    value: float = 0.0
    limit: float | None = None
    other: str = ""

    def __str__(self) -> str:
        return _WORDS[self.kind](self)


_WORDS: Mapping[Kind, Callable[[Rejection], str]] = {
    "live": lambda r: "a live stream",
    "too_long": lambda r: f"{r.value:g} s long, the limit is {r.limit:g} s",
    "found_twice": lambda r: "found twice",
    "known": lambda r: "assessed before",
    "less_watched": lambda r: f"not among the {r.limit:g} most watched",
    "further_down": lambda r: f"not among the first {r.limit:g}",
    "no_person": lambda r: f"no person found in {r.value:g} of {r.value:g} frames",
    "person_missing": lambda r: (
        f"a person in {r.value:.0%} of the frames, at least {r.limit:.0%} are needed"
    ),
    "body_cut_off": lambda r: (
        f"the full body in view in {r.value:.0%} of the frames, at least {r.limit:.0%} are needed"
    ),
    "too_short": lambda r: f"{r.value:.1f} s long, at least {r.limit:g} s",
    "person_small": lambda r: (
        f"the person is {r.value:.0f} px tall, at least {r.limit:.0f} px are needed"
    ),
    "camera_moves": lambda r: f"the camera moves: still for {r.value:.0%} of the time",
    "slideshow": lambda r: f"a slideshow: {r.value:.0%} of the frames differ from the one before",
    "still_picture": lambda r: (
        f"a still picture: {r.value:.0%} of the frames differ from the one before"
    ),
    "people": lambda r: f"{r.value:g} people in view",
    "cuts": lambda r: f"{r.value:g} cut{'s' if r.value > 1 else ''}",
    "drawing": lambda r: f"a drawing: {r.value:.0%} of the body is flat colour",
    "copy": lambda r: f"a copy of {r.other}",
    "mirrored_copy": lambda r: f"a mirrored copy of {r.other}",
}
