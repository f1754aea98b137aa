"""Search a source for videos of a dance. Never cached: results change from day to day."""

from datetime import UTC, datetime

from prefect import task

from robojackson.clips.sources import source
from robojackson.clips.web.file_version import versioned
from robojackson.clips.web.video_candidate import VideoCandidate
from robojackson.clips.web.yt_dlp_client import WebConfig


@task(name="search_videos", persist_result=False, task_run_name="search_videos-{name}")
def search_videos(
    name: str, query: str, address: str, count: int, web: WebConfig
) -> tuple[VideoCandidate, ...]:
    """Return candidates in the source's own order; a file that was replaced under its address is
    another one."""
    return versioned(source(name).search(query, address, count, web, datetime.now(UTC)), web)
