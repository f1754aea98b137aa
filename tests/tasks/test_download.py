"""A file comes over the net once, whole or not at all, and stays inside the store."""

from pathlib import Path

import pytest

from robojackson.clips.formats import FormatConfig
from robojackson.clips.video import VideoLimits
from robojackson.errors import TruncatedVideo
from storage.artifact import Artifact
from storage.store import Store
from tasks.download import WebVideo, download
from tests.search.conftest import small_video, web
from tests.search.server import PATIENT, Web

__all__ = ["small_video", "web"]


def bring(web: Web, path: str = "good/clip.mp4", video_id: str = "v1") -> Artifact:
    video = WebVideo("generic", video_id, f"{web.url}/{path}", "A title")
    return download.fn(video, "score", FormatConfig(), PATIENT, VideoLimits())


def test_the_file_is_in_the_store(web: Web, store_folder: Path) -> None:
    assert Store(store_folder).read(bring(web).key) == web.video


def test_a_second_download_asks_what_there_is_and_fetches_nothing(
    web: Web, store_folder: Path
) -> None:
    """The page and the file of a bare video are one address: first both are asked for, then one."""
    first = bring(web)
    before = len(web.asked)
    assert bring(web) == first
    assert (before, len(web.asked) - before) == (2, 1)


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


@pytest.mark.parametrize("video_id", ["../../x", "/tmp/x", "..", "a\x00b", "x" * 300, "", "\u202e"])
def test_no_id_leaves_the_store(
    web: Web, store_folder: Path, tmp_path: Path, video_id: str
) -> None:
    made = bring(web, video_id=video_id)
    outside = {path for path in tmp_path.rglob("*") if store_folder not in (path, *path.parents)}
    assert outside == set()
    assert Store(store_folder).read(made.key) == web.video
