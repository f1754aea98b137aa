"""The search that `find` and `refresh` share: from a query to ranked videos and the one to dance.

Search, select, download, assess, rank, record. A video that fails on the way gets its reason and
harms no other; only a search that fails is an error.
"""

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from prefect.futures import PrefectFuture
from prefect.logging import get_run_logger

from configs.dance_book import Dance
from configs.find_config import FindConfig
from flows.search.search_entries import REASON_LENGTH, Entry, SearchResult, reason_of, rows, summary
from robojackson.clips.quality import candidate_ranking
from robojackson.clips.quality.assessment import Quality
from robojackson.clips.quality.duplicates import find_duplicates
from robojackson.clips.quality.stability import Stability
from robojackson.clips.rejection import Rejection
from robojackson.clips.sources import folder
from robojackson.clips.web.candidate_selection import select
from robojackson.clips.web.download_formats import Purpose
from robojackson.clips.web.untrusted_text import clean_text
from robojackson.clips.web.video_candidate import VideoCandidate
from robojackson.motion.landmark_track import LandmarkTrack
from storage import artifact_tables, candidate_catalogue
from storage.artifact import Artifact
from storage.store import Store
from tasks.assess_video import assess_video
from tasks.download_video import WebVideo, download_video, take_file
from tasks.probe_video import SourceFile
from tasks.search_videos import search_videos

USUAL_FPS = 30.0
"""Frames a second of a video whose length is not known."""


def search_and_rank(
    dance: Dance,
    settings: FindConfig,
    run_id: str,
    known: Collection[tuple[str, str]] = (),
    reigning: Mapping[str, Any] | None = None,
    failed: Collection[tuple[str, str]] = (),
) -> SearchResult:
    """Find, assess and rank the videos of a dance; every one of them goes into the catalogue.

    Args:
        dance: Query, language and number of videos.
        settings: Source, filters and ranking.
        run_id: Run id for the catalogue.
        known: Videos that were assessed before and need not be again.
        reigning: Row of the catalogue of the video chosen last, which a new one has to beat.
        failed: Videos that failed before and are tried again where there is nothing else.
    Raises:
        SearchFailed: the source does not answer.
    """
    web = replace(settings.web, language=dance.language or settings.web.language)
    limits = replace(settings.selection, top=dance.top or settings.selection.top)
    source = replace(settings, web=web, selection=limits)
    found = search_videos(dance.source, dance.full_query, dance.address, limits.searched, web)
    selection = select(found, known, limits, failed)
    get_run_logger().info("%s: %s", dance.name, summary(found, selection))
    downloaded = download_candidates(selection.selected, "score", source)
    entries = challenged(ranked(assess_candidates(downloaded, source), source), reigning, source)
    made = SearchResult(dance, run_id, tuple(entries), selection)
    candidate_catalogue.append(Store.from_environment(), rows(made))
    return made


def download_candidates(
    candidates: Sequence[VideoCandidate], purpose: Purpose, settings: FindConfig
) -> list[tuple[VideoCandidate, Artifact | str]]:
    """Return the files of candidates in one format; the reason instead of one that fails."""
    waiting: list[PrefectFuture[Any] | str] = []
    for candidate in candidates:
        waiting.append(_submitted(candidate, purpose, settings))
    return [(c, _outcome(w)) for c, w in zip(candidates, waiting, strict=True)]


def assess_candidates(
    downloaded: Sequence[tuple[VideoCandidate, Artifact | str]], settings: FindConfig
) -> list[Entry]:
    """Return all candidates with their figures, or with the reason why there are none."""
    there = [video for _, video in downloaded if isinstance(video, Artifact)]
    outcomes = iter(assess_video.outcomes([(video, settings.assessment) for video in there]))
    entries = []
    for candidate, video in downloaded:
        if isinstance(video, str):
            entries.append(Entry(candidate, reason=video))
            continue
        made = _or_reason(next(outcomes))
        is_failed = isinstance(made, str)
        entries.append(
            Entry(candidate, reason=made, video=video)
            if is_failed
            else _with_figures(Entry(candidate, video=video, artifacts=made))
        )
    return entries


def ranked(entries: Sequence[Entry], settings: FindConfig) -> list[Entry]:
    """Return the entries in the order of their places, each with its decision and reason."""
    config = settings.filters
    by_name = {f"{i}": entry for i, entry in enumerate(entries) if entry.score}
    scores = {name: entry.score for name, entry in by_name.items() if entry.score}
    order = candidate_ranking.order(scores, config)
    against = {
        name: candidate_ranking.objections(entry.score, entry.quality, config)
        for name, entry in by_name.items()
        if entry.score and entry.quality
    }
    copied = _copied({name: by_name[name] for name in order if not against[name]}, settings)
    places = candidate_ranking.rank(order, against, copied)
    done = [replace(by_name[p.name], decision=p.decision, reason=p.reason) for p in places]
    return done + [entry for entry in entries if not entry.score]


def challenged(
    entries: Sequence[Entry], reigning: Mapping[str, Any] | None, settings: FindConfig
) -> list[Entry]:
    """Return the entries, the best one not chosen if the video that was chosen last is steadier."""
    if reigning is None or not entries or entries[0].decision != "chosen":
        return list(entries)
    first = entries[0]
    assert first.score
    both = {"old": _score_of(reigning), "new": first.score}
    if candidate_ranking.order(both, settings.filters)[0] == "new":
        return list(entries)
    reason = clean_text(f"{reigning['title'] or reigning['video_id']} is steadier", REASON_LENGTH)
    return [replace(first, decision="accepted", reason=reason), *entries[1:]]


def steadiest(
    assessed: Sequence[Mapping[str, Any]], settings: FindConfig
) -> Mapping[str, Any] | None:
    """Return the row of the catalogue that ranks first, None of no rows."""
    scores = {f"{i}": _score_of(row) for i, row in enumerate(assessed)}
    order = candidate_ranking.order(scores, settings.filters)
    return assessed[int(order[0])] if order else None


def _score_of(row: Mapping[str, Any]) -> Stability:
    """Return the score in a row of the catalogue."""
    score = Stability(**{f.name: row[f.name] for f in fields(Stability)})
    if score.score_per_second is not None:
        return score
    seconds = row["duration_s"] or row["frames"] / USUAL_FPS  # before there was such a column
    return replace(score, score_per_second=score.stability_score / seconds)


def _submitted(
    candidate: VideoCandidate, purpose: Purpose, settings: FindConfig
) -> PrefectFuture[Any] | str:
    """Return the task that downloads a video; the reason when a local file cannot be read."""
    if candidate.source == folder.NAME:
        try:
            return take_file.submit(SourceFile.at(Path(candidate.url)))
        except OSError as cause:
            return clean_text(f"cannot be read ({cause.strerror})")
    video, limits = WebVideo.of(candidate), settings.assessment.video
    return download_video.submit(video, purpose, settings.formats, settings.web, limits)


def _outcome(future: PrefectFuture[Any] | str) -> Any:
    """Return the result of a task, or the reason in one line."""
    if isinstance(future, str):
        return future
    return _or_reason(future.result(raise_on_failure=False))


def _or_reason(result: Any) -> Any:
    """Return a result as it is, and an exception as its reason in one line."""
    if not isinstance(result, BaseException):
        return result
    reason = reason_of(result)
    get_run_logger().warning("%s", reason)
    return reason


def _with_figures(entry: Entry) -> Entry:
    store = Store.from_environment()
    assert entry.artifacts
    score = artifact_tables.read(Stability, store, entry.artifacts["stability"])
    return replace(entry, score=score, quality=_quality(store, entry.artifacts["quality"]))


def _quality(store: Store, artifact: Artifact) -> Quality:
    return Quality(**json.loads(store.read(artifact.key)))


def _copied(fit: dict[str, Entry], settings: FindConfig) -> dict[str, Rejection]:
    """Return the videos that are copies of others, by name; a rejection names the other's title."""
    if settings.filters.copies is None:
        return {}
    store = Store.from_environment()
    largest = sorted(fit, key=lambda n: -(q.person_height_px if (q := fit[n].quality) else 0.0))
    tracks = {
        name: artifact_tables.read(LandmarkTrack, store, made["landmarks"])
        for name in largest
        if (made := fit[name].artifacts)
    }
    found = find_duplicates(tracks, settings.filters.copies)
    return {name: replace(copy, other=_title(fit[copy.other])) for name, copy in found.items()}


def _title(entry: Entry) -> str:
    return entry.candidate.title or entry.candidate.video_id
