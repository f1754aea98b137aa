"""Which candidate is danced: the lowest score of Algorithm 1 among those that no filter rejects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass as configuration

from robojackson.clips.quality.assessment import Quality
from robojackson.clips.quality.duplicates import DuplicateConfig
from robojackson.clips.quality.stability import Stability


@configuration(frozen=True, config=ConfigDict(extra="forbid"))
class FilterConfig:
    """What a clip must be. None switches a filter off; its figure stays in the table.

    Attributes:
        rank_by: The paper's sum, or the sum a frame, which does not favour short clips.
        shortest_s: Shortest clip, seconds.
        detected_share: Least share of frames with a person.
        full_body_share: Least share of frames with head, trunk and legs in view.
        person_height_px: Least height of the person in the scored image, pixels.
        people: Most people.
        cuts: Most cuts.
        static_share: Least share of the time in which the camera stands still.
        moving_share: Least share of frames that differ from the one before.
        flat_share: Most share of the body in flat colour, which a drawing has.
        copies: When two clips count as the same.
    """

    rank_by: Literal["sum", "frame"] = "sum"
    shortest_s: float | None = 1.0
    detected_share: float | None = 0.9
    full_body_share: float | None = 0.7
    person_height_px: float | None = 140.0
    people: int | None = 1
    cuts: int | None = 0
    static_share: float | None = 0.8
    moving_share: float | None = 0.25
    flat_share: float | None = 0.6
    copies: DuplicateConfig | None = Field(default_factory=DuplicateConfig)


@dataclass(frozen=True)
class Ranked:
    """A candidate's place.

    Attributes:
        name: Of the candidate.
        place: 1 is danced; None when it is rejected.
        reason: Why it is rejected; empty when it is not.
    """

    name: str
    place: int | None
    reason: str

    @property
    def decision(self) -> Literal["chosen", "accepted", "rejected"]:
        """In one word."""
        if self.place is None:
            return "rejected"
        return "chosen" if self.place == 1 else "accepted"


def objections(score: Stability, quality: Quality, config: FilterConfig) -> list[str]:
    """Every reason against a clip; a clip without a person has that one only."""
    if not score.detected:
        return [f"no person found in {score.frames} of {score.frames} frames"]
    found = [*_too_little(quality, config), *_too_much(quality, config)]
    return [reason for reason in found if reason]


def order(scores: Mapping[str, Stability], config: FilterConfig) -> list[str]:
    """Names of the clips, the steadiest first; those without a person last."""

    def figure(name: str) -> tuple[bool, float]:
        score = scores[name]
        by_frame = config.rank_by == "frame"
        value = score.stability_score / max(score.frames, 1) if by_frame else score.stability_score
        return not score.detected, value

    return sorted(scores, key=figure)


def rank(
    ordered: Sequence[str],
    against: Mapping[str, Sequence[str]],
    copied: Mapping[str, str],
) -> list[Ranked]:
    """Places of all clips: those that nothing speaks against first, then the rejected ones.

    Args:
        ordered: The steadiest first.
        against: `objections` of each.
        copied: What is a copy of what, among those that nothing else speaks against.
    """
    accepted: list[Ranked] = []
    rejected: list[Ranked] = []
    for name in ordered:
        reasons = [*against.get(name, ()), *([copied[name]] if name in copied else [])]
        if reasons:
            rejected.append(Ranked(name, None, "; ".join(reasons)))
        else:
            accepted.append(Ranked(name, len(accepted) + 1, ""))
    return [*accepted, *rejected]


def _too_little(quality: Quality, config: FilterConfig) -> list[str]:
    shares = (
        ("a person in", quality.detected_share, config.detected_share),
        ("the full body in view in", quality.full_body_share, config.full_body_share),
    )
    found = [
        f"{what} {value:.0%} of the frames, at least {least:.0%} are needed"
        for what, value, least in shares
        if least is not None and value < least
    ]
    if config.shortest_s is not None and quality.duration_s < config.shortest_s:
        found.append(f"{quality.duration_s:.1f} s long, at least {config.shortest_s:g} s")
    if config.person_height_px is not None and quality.person_height_px < config.person_height_px:
        tall, least = quality.person_height_px, config.person_height_px
        found.append(f"the person is {tall:.0f} px tall, at least {least:.0f} px are needed")
    if config.static_share is not None and quality.static_share < config.static_share:
        found.append(f"the camera moves: still for {quality.static_share:.0%} of the time")
    return found


def _too_much(quality: Quality, config: FilterConfig) -> list[str]:
    is_still = config.moving_share is not None and quality.moving_share < config.moving_share
    if is_still:
        kind = "a slideshow" if quality.cuts else "a still picture"
        return [f"{kind}: {quality.moving_share:.0%} of the frames differ from the one before"]
    found = []
    if config.people is not None and quality.people > config.people:
        found.append(f"{quality.people} people in view")
    if config.cuts is not None and quality.cuts > config.cuts:
        found.append(f"{quality.cuts} cut{'s' if quality.cuts > 1 else ''}")
    if config.flat_share is not None and quality.flat_share > config.flat_share:
        found.append(f"a drawing: {quality.flat_share:.0%} of the body is flat colour")
    return found
