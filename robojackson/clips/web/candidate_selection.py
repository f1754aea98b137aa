"""Select the search results that are worth a download, before any is downloaded."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from pydantic import Field

from robojackson.clips.rejection import Rejection
from robojackson.clips.web.video_candidate import VideoCandidate
from robojackson.config import config_dataclass


@config_dataclass
class SelectionConfig:
    """Rules of the selection.

    Attributes:
        max_duration_s: A video of this length or longer is dropped, seconds; a short has less.
        top: How many of the most watched are kept, or of the first where no views are known.
        searched: How many results to request; most of them are dropped. Folders, lists of addresses
            and pages of servers are read to their end.
    """

    max_duration_s: float = Field(default=60.0, gt=0)
    top: int = Field(default=5, ge=1)
    searched: int = Field(default=40, ge=1)


@dataclass(frozen=True)
class Selection:
    """Result of a selection.

    Attributes:
        selected: The most watched first.
        dropped: The others, in the order of the search, each with the reason.
    """

    selected: tuple[VideoCandidate, ...]
    dropped: tuple[tuple[VideoCandidate, Rejection], ...]


def select(
    found: Sequence[VideoCandidate],
    known: Collection[tuple[str, str]],
    config: SelectionConfig,
    failed: Collection[tuple[str, str]] = (),
) -> Selection:
    """Return the videos to download: no long ones, no live streams, each once, the most watched
    first.

    One that failed before waits until there is no other: or a few that always fail would take all
    places every night.

    A video of unknown length is kept: the downloaded file will show its length.

    Args:
        found: Candidates in the order of the search, which breaks ties of the view count.
        known: Keys of videos that were assessed before.
        config: Limits.
        failed: Keys of videos that could not be downloaded or assessed before.
    """
    fit: list[VideoCandidate] = []
    dropped: list[tuple[VideoCandidate, Rejection]] = []
    seen: set[tuple[str, str]] = set()
    for candidate in found:
        rejection = _rejection(candidate, seen, known, config)
        seen.add(candidate.key)
        if rejection:
            dropped.append((candidate, rejection))
        else:
            fit.append(candidate)
    ordered = sorted(fit, key=lambda c: (c.key in failed, -_views(c)))
    is_counted = any(candidate.view_count is not None for candidate in ordered)
    left_out = Rejection("less_watched" if is_counted else "further_down", limit=config.top)
    spare = [(c, left_out) for c in ordered[config.top :]]
    return Selection(tuple(ordered[: config.top]), (*dropped, *spare))


def _views(candidate: VideoCandidate) -> int:
    return -1 if candidate.view_count is None else candidate.view_count


def _rejection(
    candidate: VideoCandidate,
    seen: Collection[tuple[str, str]],
    known: Collection[tuple[str, str]],
    config: SelectionConfig,
) -> Rejection | None:
    """Return why a candidate is dropped; None when it is not."""
    if candidate.live:
        return Rejection("live")
    if candidate.duration_s is not None and candidate.duration_s >= config.max_duration_s:
        return Rejection("too_long", candidate.duration_s, config.max_duration_s)
    if candidate.key in seen:
        return Rejection("found_twice")
    return Rejection("known") if candidate.key in known else None
