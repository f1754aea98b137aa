"""Which of the videos that a search found are worth a download: decided before any is."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass as configuration

from robojackson.clips.web.video_candidate import VideoCandidate


@configuration(frozen=True, config=ConfigDict(extra="forbid"))
class SelectionConfig:
    """What is kept of a search.

    Attributes:
        max_duration_s: A video of this length or longer is dropped, seconds; a short has less.
        top: How many of the most watched are kept.
        searched: How many the search is asked for; most of what it finds is dropped.
    """

    max_duration_s: float = Field(default=60.0, gt=0)
    top: int = Field(default=5, ge=1)
    searched: int = Field(default=40, ge=1)


@dataclass(frozen=True)
class Selection:
    """What is left of a search.

    Attributes:
        selected: The most watched first.
        dropped: The others, in the order of the search, each with the reason.
    """

    selected: tuple[VideoCandidate, ...]
    dropped: tuple[tuple[VideoCandidate, str], ...]


def select(
    found: Sequence[VideoCandidate],
    known: Collection[tuple[str, str]],
    config: SelectionConfig,
    failed: Collection[tuple[str, str]] = (),
) -> Selection:
    """The videos to download: no long ones, no live streams, each once, the most watched first.

    One that failed before waits until there is no other: or a few that always fail would take all
    places every night.

    A video whose length the source does not tell is kept: the downloaded file will tell.

    Args:
        found: In the order of the search, which breaks ties of the view count.
        known: Keys of videos that were judged before.
        config: Limits.
        failed: Keys of videos that could not be had or judged before.
    """
    fit: list[VideoCandidate] = []
    dropped: list[tuple[VideoCandidate, str]] = []
    seen: set[tuple[str, str]] = set()
    for candidate in found:
        reason = _reason(candidate, seen, known, config)
        seen.add(candidate.key)
        if reason:
            dropped.append((candidate, reason))
        else:
            fit.append(candidate)
    ordered = sorted(fit, key=lambda c: (c.key in failed, -_views(c)))
    spare = [(c, f"not among the {config.top} most watched") for c in ordered[config.top :]]
    return Selection(tuple(ordered[: config.top]), (*dropped, *spare))


def _views(candidate: VideoCandidate) -> int:
    return -1 if candidate.view_count is None else candidate.view_count


def _reason(
    candidate: VideoCandidate,
    seen: Collection[tuple[str, str]],
    known: Collection[tuple[str, str]],
    config: SelectionConfig,
) -> str:
    """Why a candidate is dropped; empty when it is not."""
    if candidate.live:
        return "a live stream"
    if candidate.duration_s is not None and candidate.duration_s >= config.max_duration_s:
        return f"{candidate.duration_s:g} s long, the limit is {config.max_duration_s:g} s"
    if candidate.key in seen:
        return "found twice"
    return "judged before" if candidate.key in known else ""
