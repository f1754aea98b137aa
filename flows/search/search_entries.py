"""Outcome of every video of a search, and the same as rows of the catalogue."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from datetime import UTC, datetime
from typing import Any

from configs.dance_book import Dance
from robojackson.clips.quality.assessment import Quality
from robojackson.clips.quality.stability import Stability
from robojackson.clips.web.candidate_selection import Selection
from robojackson.clips.web.untrusted_text import clean_text
from robojackson.clips.web.video_candidate import VideoCandidate
from robojackson.errors import RoboJacksonError
from storage.artifact import Artifact

REASON_LENGTH = 200


@dataclass(frozen=True)
class Entry:
    """A candidate and what became of it.

    Attributes:
        candidate: The video.
        decision: chosen, accepted, rejected or failed.
        reason: Why not; empty for those that may be danced.
        video: Its scored file; None when the download failed.
        artifacts: Results of the assessment.
        score, quality: The figures; None when it could not be assessed.
    """

    candidate: VideoCandidate
    decision: str = "failed"
    reason: str = ""
    video: Artifact | None = None
    artifacts: dict[str, Artifact] | None = None
    score: Stability | None = None
    quality: Quality | None = None


@dataclass(frozen=True)
class SearchResult:
    """Result of a search.

    Attributes:
        dance: The dance of the search.
        run_id: Under which it is in the catalogue.
        entries: The chosen one first, then by rank, rejected and failed ones last.
        selection: Selection of the search.
    """

    dance: Dance
    run_id: str
    entries: tuple[Entry, ...]
    selection: Selection

    @property
    def chosen(self) -> Entry | None:
        """The entry to dance; None when all are rejected."""
        return next((entry for entry in self.entries if entry.decision == "chosen"), None)


def rows(found: SearchResult) -> list[dict[str, Any]]:
    """Return the entries as rows of the catalogue."""
    now = datetime.now(UTC)
    labels = {"run_id": found.run_id, "dance": found.dance.name, "decided_at": now}
    return [{**labels, **_row(entry)} for entry in found.entries]


def summary(found: Sequence[VideoCandidate], selection: Selection) -> str:
    """Return what the selection did, in one line."""
    kinds = Counter(rejection.kind for _, rejection in selection.dropped)
    words = {rejection.kind: str(rejection) for _, rejection in selection.dropped}
    words["too_long"] = "too long"
    dropped = ", ".join(f"{count} {words[kind]}" for kind, count in kinds.items())
    line = f"{len(found)} found, {len(selection.selected)} assessed"
    return f"{line} ({dropped})" if dropped else line


def reason_of(error: BaseException) -> str:
    """Return an error as the reason in a table: one line, without the path of our own copy."""
    if not isinstance(error, RoboJacksonError):
        return clean_text(f"unexpected {type(error).__name__}: {error}", REASON_LENGTH)
    return clean_text(error.reason, REASON_LENGTH)


def _row(entry: Entry) -> dict[str, Any]:
    candidate = entry.candidate
    columns = {f.name: getattr(candidate, f.name) for f in fields(candidate) if f.name != "live"}
    measured = asdict(entry.quality) if entry.quality else {}
    scored = asdict(entry.score) if entry.score else {}
    video = entry.video
    return {
        **columns,
        **measured,
        **scored,
        "decision": entry.decision,
        "reason": entry.reason,
        "video_key": video.key if video else None,
        "video_sha256": video.sha256 if video else None,
    }
