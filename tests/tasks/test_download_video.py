"""A file comes over the net once, whole or not at all, and stays inside the store."""

from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path
from threading import Barrier
from typing import Any

import pytest

from robojackson.clips.video import VideoLimits
from robojackson.clips.web.download_formats import FormatConfig
from robojackson.clips.web.yt_dlp_client import Offer
from robojackson.errors import TruncatedVideo
from storage.artifact import Artifact
from storage.store import Store
from tasks import download_video as task
from tasks.download_video import WebVideo, download_video, stored_video
from tests.clips.web.conftest import small_video, web
from tests.fixtures.web_server import PATIENT, Web

__all__ = ["small_video", "web"]


def bring(web: Web, path: str = "good/clip.mp4", video_id: str = "v1") -> Artifact:
    video = WebVideo("generic", video_id, f"{web.url}/{path}", "A title")
    return download_video.fn(video, "score", FormatConfig(), PATIENT, VideoLimits())


@pytest.mark.medium
def test_the_file_is_in_the_store(web: Web, store_folder: Path) -> None:
    assert Store(store_folder).read(bring(web).key) == web.video


def test_a_second_download_checks_the_file_and_fetches_nothing(
    web: Web, store_folder: Path
) -> None:
    """The page and the file of a bare video are one address: first both are requested, then one."""
    first = bring(web)
    before = len(web.requests)
    assert bring(web) == first
    assert (before, len(web.requests) - before) == (2, 1)


@pytest.mark.medium
def test_two_runs_that_want_a_video_at_once_fetch_it_once(
    web: Web, store_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both see that it is not there; then one brings it and the other waits."""
    both, looks, look, fetch = Barrier(2), count(), task._earlier_download, task.fetch
    fetched: list[Path] = []

    def late(store: Store, *what: Any) -> Artifact | None:
        had = look(store, *what)
        if next(looks) < 2:
            both.wait(10)
        return had

    def counted(chosen: Offer, folder: Path, *rest: Any) -> Path:
        fetched.append(folder)
        return fetch(chosen, folder, *rest)

    monkeypatch.setattr(task, "_earlier_download", late)
    monkeypatch.setattr(task, "fetch", counted)
    with ThreadPoolExecutor(2) as pool:
        made = list(pool.map(lambda _: bring(web), range(2)))
    assert len(fetched) == 1
    assert made[0] == made[1]
    assert list((store_folder / "work" / "downloads" / "generic").iterdir()) == []


@pytest.mark.medium
def test_an_altered_file_is_downloaded_again(web: Web, store_folder: Path) -> None:
    first = bring(web)
    (store_folder / first.key).write_bytes(b"altered")
    assert Store(store_folder).read(bring(web).key) == web.video


def test_nothing_half_made_is_left_behind(web: Web, store_folder: Path) -> None:
    bring(web)
    assert [path for path in (store_folder / "work").rglob("*") if path.is_file()] == []


def test_a_file_that_is_no_whole_video_is_thrown_away(web: Web, store_folder: Path) -> None:
    with pytest.raises(TruncatedVideo):
        bring(web, "wrong_length/clip.mp4")
    assert [path for path in store_folder.rglob("*") if path.is_file()] == []


@pytest.mark.medium
@pytest.mark.parametrize("video_id", ["../../x", "/tmp/x", "..", "a\x00b", "x" * 300, "", "\u202e"])
def test_no_id_leaves_the_store(
    web: Web, store_folder: Path, tmp_path: Path, video_id: str
) -> None:
    made = bring(web, video_id=video_id)
    outside = {path for path in tmp_path.rglob("*") if store_folder not in (path, *path.parents)}
    assert outside == set()
    assert Store(store_folder).read(made.key) == web.video


@pytest.mark.parametrize(
    ("video_id", "is_it"),
    [("clip-0123456789ab-89abcdef", True), ("clip-0123456789ab-89abcdef0", False), ("clip", False)],
)
def test_without_its_server_any_version_of_a_file_is_found(
    video_id: str, is_it: bool, web: Web, store_folder: Path
) -> None:
    made = bring(web, video_id=video_id)
    other = WebVideo("generic", "clip-0123456789ab", web.url, "A title")
    assert stored_video(Store(store_folder), other) == (made if is_it else None)
