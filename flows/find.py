"""Find the best video of a dance: search, download, assess and rank, nothing after that.

Entry point of the deployment: `flows.find.find`.
"""

import uuid
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from typing import Any

from prefect import flow
from prefect.logging import get_run_logger
from prefect.task_runners import ThreadPoolTaskRunner

from configs.dance_book import Dance, DanceBook
from configs.find_config import FindConfig
from flows.runtime.launch import launch
from flows.search.refresh_notes import KIND
from flows.search.search_artifacts import publish_search
from flows.search.search_entries import Entry, SearchResult, rows, summary
from flows.search.search_pipeline import download_candidates, search_and_rank
from robojackson.clips.sources import folder
from robojackson.clips.web.video_candidate import VideoCandidate
from robojackson.errors import NoPersonFound, SearchFailed
from robojackson.files.processor_cores import cores
from robojackson.pipeline.yaml_loader import build, load
from storage import candidate_catalogue
from storage.artifact import Artifact
from storage.leftovers import sweep
from storage.store import Store
from tasks.download_video import WebVideo, stored_video

BOOK = "dances"
"""Where the dances are named: a file of `configs`."""
HUNTERS: ThreadPoolTaskRunner[Any] = ThreadPoolTaskRunner(max_workers=2 * cores())
"""Downloads wait for servers, assessments for their processes: more threads than cores."""


@flow(name="find", flow_run_name="find-{name}", task_runner=HUNTERS)  # type: ignore[arg-type]
async def find(
    name: str,
    dance: dict[str, Any] | None = None,
    config: str = "finding",
    overrides: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the ranked videos of one dance.

    Args:
        name: Shown as the name of the run.
        dance: A `Dance`, as a mapping; without it that of the name in the book, or the words of the
            name.
        config: Name or path of the configuration of the search.
        overrides: Values by key path.
    """
    sweep(Store.from_environment(), work=False)
    settings = load(FindConfig, config, overrides)
    named = load(DanceBook, BOOK).find(name) if dance is None else build(Dance, dance, "dance")
    found = search_and_rank(named, settings, run_id("find"))
    table = rows(found)
    await publish_search(found.dance.name, table, table[0] if found.chosen else None)
    return summarise(found)


def run(requested: Dance, config: str, overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Return the flow from the command line.

    Raises:
        SearchFailed: the source does not answer.
        DeploymentFailed: the Prefect server that is named does not answer, or refuses us.
    """
    return launch(find, requested.name, asdict(requested), config, dict(overrides))


@flow(name="best", flow_run_name="best-{name}", task_runner=HUNTERS)  # type: ignore[arg-type]
async def best(
    name: str,
    dance: dict[str, Any],
    config: str = "finding",
    overrides: dict[str, Any] | None = None,
) -> dict[str, str]:
    """Search, and download the steadiest video, or the one of the nightly refresh where that is
    steadier, in good quality; return its artifact."""
    settings = load(FindConfig, config, overrides)
    requested = build(Dance, dance, "dance")
    store = Store.from_environment()
    reigning = candidate_catalogue.champion(store, requested.name, KIND)
    try:
        found = search_and_rank(requested, settings, run_id("dance"), reigning=reigning)
    except SearchFailed:
        kept = candidate_catalogue.champion(store, requested.name)
        if kept is None:
            raise
        return asdict(stored_video(store, WebVideo.of(_candidate(kept))) or _scored(kept))
    table = rows(found)
    chosen = table[0] if found.chosen else reigning
    await publish_search(requested.name, table, chosen)
    if chosen is None:
        raise NoPersonFound(nothing(found))
    if found.chosen is None:
        get_run_logger().info("%s: no new video is steadier than %s", name, chosen["url"])
        return asdict(of_champion(chosen, settings))
    return asdict(in_good_quality(found.chosen, settings))


def in_good_quality(chosen: Entry, settings: FindConfig) -> Artifact:
    """Return the file to dance: the best format, or the scored one when that is not available."""
    return of_candidate(chosen.candidate, chosen.video, settings)


def of_candidate(
    candidate: VideoCandidate, scored: Artifact | None, settings: FindConfig
) -> Artifact:
    """Return the best format of a video, or, where that cannot be downloaded, the largest file of
    an earlier run, or the scored one.

    Raises:
        SearchFailed: none is there.
    """
    ((_, video),) = download_candidates([candidate], "dance", settings)
    if isinstance(video, Artifact):
        return video
    stored = stored_video(Store.from_environment(), WebVideo.of(candidate)) or scored
    if stored is None:
        raise SearchFailed(f"{candidate.title or candidate.video_id}: {video}")
    get_run_logger().warning("%s: %s: its stored video is used", candidate.url, video)
    return stored


def of_champion(row: Mapping[str, Any], settings: FindConfig) -> Artifact:
    """Return the file to dance of a video that the catalogue has: what was assessed of a file of
    this machine, which may be another by now; of the web the best format."""
    scored = _scored(row)
    if row["source"] == folder.NAME:
        return scored
    return of_candidate(_candidate(row), scored, settings)


def _candidate(row: Mapping[str, Any]) -> VideoCandidate:
    """Return the video of a row of the catalogue."""
    return VideoCandidate(
        video_id=row["video_id"],
        url=row["url"],
        title=row["title"] or "",
        query=row["query"] or "",
        source=row["source"],
    )


def _scored(row: Mapping[str, Any]) -> Artifact:
    """Return the file that was assessed."""
    return Artifact(key=row["video_key"], sha256=row["video_sha256"])


def nothing(found: SearchResult) -> str:
    """Return in one line why no video of a search may be danced."""
    if not found.entries:
        return f"{found.dance.name}: no video is left of the search"
    table = (f"{e.candidate.title or e.candidate.video_id}: {e.reason}" for e in found.entries)
    return (
        f"{found.dance.name}: none of {len(found.entries)} videos may be danced: {'; '.join(table)}"
    )


def summarise(found: SearchResult) -> dict[str, Any]:
    """Return the answer of the command."""
    table = rows(found)
    every = [*found.selection.selected, *(c for c, _ in found.selection.dropped)]
    return {
        "dance": found.dance.name,
        "query": found.dance.full_query,
        "source": found.dance.source,
        "run_id": found.run_id,
        "chosen": table[0] if found.chosen else None,
        "candidates": table,
        "dropped": [
            {"title": c.title, "url": c.url, "reason": str(r)} for c, r in found.selection.dropped
        ],
        "summary": summary(every, found.selection),
    }


def run_id(kind: str) -> str:
    """Return a name that no other run has."""
    return f"{kind}-{datetime.now(UTC):%Y%m%d-%H%M%S}-{uuid.uuid4().hex[:6]}"
