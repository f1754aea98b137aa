"""Rank candidates: the lowest score of Algorithm 1 among those that no filter rejects wins."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field, NonNegativeFloat, NonNegativeInt

from robojackson.clips.quality.assessment import Quality
from robojackson.clips.quality.duplicates import DuplicateConfig
from robojackson.clips.quality.stability import Stability
from robojackson.clips.rejection import Kind, Rejection
from robojackson.config import config_dataclass

Share = Annotated[float, Field(ge=0, le=1)]


@config_dataclass
class FilterConfig:
    """Filters of clips. None switches a filter off; its figure stays in the table.

    Attributes:
        rank_by: The score a second or a frame, which do not favour short clips, or the paper's sum.
        shortest_s: Shortest clip, seconds.
        detected_share: Least share of frames with a person.
        full_body_share: Least share of frames with head, trunk and legs in view.
        person_height_px: Least height of the person in the scored image, pixels.
        people: Most people.
        cuts: Most cuts.
        static_share: Least share of the time in which the camera stands still.
        moving_share: Least share of frames that differ from the one a tenth of a second before.
        flat_share: Most share of the body in flat colour, which a drawing has.
        copies: When two clips count as the same.
    """

    rank_by: Literal["second", "frame", "sum"] = "second"
    shortest_s: NonNegativeFloat | None = 1.0
    detected_share: Share | None = 0.9
    full_body_share: Share | None = 0.7
    person_height_px: NonNegativeFloat | None = 140.0
    people: NonNegativeInt | None = 1
    cuts: NonNegativeInt | None = 0
    static_share: Share | None = 0.8
    moving_share: Share | None = 0.25
    flat_share: Share | None = 0.6
    copies: DuplicateConfig | None = Field(default_factory=DuplicateConfig)


@dataclass(frozen=True)
class Ranked:
    """A candidate's place.

    Attributes:
        name: Name of the candidate.
        place: 1 is danced; None when it is rejected.
        rejections: Why it is rejected; empty when it is not.
    """

    name: str
    place: int | None
    rejections: tuple[Rejection, ...] = ()

    @property
    def reason(self) -> str:
        """The rejections in words."""
        return "; ".join(map(str, self.rejections))

    @property
    def decision(self) -> Literal["chosen", "accepted", "rejected"]:
        """In one word."""
        if self.place is None:
            return "rejected"
        return "chosen" if self.place == 1 else "accepted"


def objections(score: Stability, quality: Quality, config: FilterConfig) -> list[Rejection]:
    """Return every reason against a clip; a clip without a person has that one only."""
    if not score.detected:
        return [Rejection("no_person", score.frames)]
    return [*_too_little(quality, config), *_too_much(quality, config)]


def order(scores: Mapping[str, Stability], config: FilterConfig) -> list[str]:
    """Return names of the clips, the steadiest first; those without a person last."""

    def figure(name: str) -> tuple[bool, float]:
        score = scores[name]
        values = {
            "second": score.score_per_second,
            "frame": score.stability_score / max(score.frames, 1),
            "sum": score.stability_score,
        }
        return not score.detected, values[config.rank_by]

    return sorted(scores, key=figure)


def rank(
    ordered: Sequence[str],
    against: Mapping[str, Sequence[Rejection]],
    copied: Mapping[str, Rejection],
) -> list[Ranked]:
    """Return the places of all clips: accepted ones first, then the rejected ones.

    Args:
        ordered: The steadiest first.
        against: `objections` of each.
        copied: What is a copy of what, among those that nothing else speaks against.
    """
    accepted: list[Ranked] = []
    rejected: list[Ranked] = []
    for name in ordered:
        found = (*against.get(name, ()), *([copied[name]] if name in copied else []))
        if found:
            rejected.append(Ranked(name, None, found))
        else:
            accepted.append(Ranked(name, len(accepted) + 1))
    return [*accepted, *rejected]


def _too_little(quality: Quality, config: FilterConfig) -> list[Rejection]:
    """Return the figures of a clip that are below their limits."""
    measured: tuple[tuple[Kind, float, float | None], ...] = (
        ("person_missing", quality.detected_share, config.detected_share),
        ("body_cut_off", quality.full_body_share, config.full_body_share),
        ("too_short", quality.duration_s, config.shortest_s),
        ("person_small", quality.person_height_px, config.person_height_px),
        ("camera_moves", quality.static_share, config.static_share),
    )
    return [
        Rejection(kind, value, least)
        for kind, value, least in measured
        if least is not None and value < least
    ]


def _too_much(quality: Quality, config: FilterConfig) -> list[Rejection]:
    """Return what a clip has more of than it may; one without motion has that reason only."""
    if config.moving_share is not None and quality.moving_share < config.moving_share:
        kind: Kind = "slideshow" if quality.cuts else "still_picture"
        return [Rejection(kind, quality.moving_share, config.moving_share)]
    measured: tuple[tuple[Kind, float, float | None], ...] = (
        ("people", quality.people, config.people),
        ("cuts", quality.cuts, config.cuts),
        ("drawing", quality.flat_share, config.flat_share),
    )
    return [
        Rejection(kind, value, most)
        for kind, value, most in measured
        if most is not None and value > most
    ]
