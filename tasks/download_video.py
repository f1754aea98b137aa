"""Put a video into the store: from the web in one format, or from a folder as it is.

A download is cached by the video's id and format: by the task's record, and where that is lost by a
note in the store, so that a file comes over the net once, also when two runs want it at once: one
waits for the other. What an interrupted download left is continued.
"""

import hashlib
import json
import re
import shutil
import sys
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from robojackson.cli.lifetime.video_process import probed
from robojackson.clips.video import VideoLimits
from robojackson.clips.web.download_formats import FormatConfig, Purpose
from robojackson.clips.web.file_version import SUFFIX
from robojackson.clips.web.untrusted_text import clean_text, in_markdown, safe_name
from robojackson.clips.web.video_candidate import GENERIC, VideoCandidate
from robojackson.clips.web.yt_dlp_client import Offer, WebConfig, fetch, offer
from robojackson.errors import StoreError, UnreadableVideo
from robojackson.pipeline.folder_lock import FOR_EVER, locked
from storage.artifact import Artifact
from storage.store import Store
from tasks.probe_video import SourceFile
from tasks.runtime.run_logger import run_logger
from tasks.runtime.stage import stage

FOLDER, NOTE = "downloads", ".json"
STEP = 0.1
"""Share of a file between two lines of progress."""


@dataclass(frozen=True)
class WebVideo:
    """A video of the web.

    Attributes:
        source, video_id: What it is.
        url, title: Where it is and what it is called; these may change.
    """

    source: str
    video_id: str
    url: str = field(compare=False)
    title: str = field(compare=False)

    @classmethod
    def of(cls, found: VideoCandidate) -> "WebVideo":
        """Return the video of a candidate."""
        return cls(found.source, found.video_id, found.url, found.title)

    @property
    def folder(self) -> str:
        """Where it is kept; both parts are made safe again, however the object was made."""
        return f"{FOLDER}/{safe_name(self.source)}/{safe_name(self.video_id)}"


@stage(unkeyed=("web", "limits"))
def download_video(
    video: WebVideo, purpose: Purpose, formats: FormatConfig, web: WebConfig, limits: VideoLimits
) -> Artifact:
    """Return a video file, in the format that serves the purpose."""
    store = Store.from_environment()
    chosen = offer(video.url, purpose, formats, web)
    had = _earlier_download(store, video, chosen)
    return had if had is not None else _download_or_reuse(store, video, chosen, web, limits)


@stage()
def take_file(file: SourceFile) -> Artifact:
    """Return a video of a folder."""
    suffix = safe_name(file.path.suffix.lstrip(".").lower() or "mp4")
    return Store.from_environment().save("video", f"clip.{suffix}", file.path)


def stored_video(store: Store, video: WebVideo) -> Artifact | None:
    """Return an earlier download of a video, of several formats the one with the largest file; of
    an address whose server does not answer, that of any version of its file."""
    keys = store.list(video.folder)
    if not keys and video.source == GENERIC:
        of_a_version = re.compile(re.escape(video.folder) + SUFFIX.pattern + "/")
        keys = [key for key in store.list(f"{FOLDER}/{GENERIC}") if of_a_version.match(key)]
    notes = [key for key in keys if key.endswith(NOTE)]
    found = [had for note in notes if (had := _noted(store, note)) is not None]
    return max(found, key=lambda had: len(store.read(had.key)), default=None)


def _earlier_download(store: Store, video: WebVideo, chosen: Offer) -> Artifact | None:
    """Return the file of an earlier download in one format, if it is there unaltered."""
    note = f"{video.folder}/{chosen.name}{NOTE}"
    return _noted(store, note) if store.exists(note) else None


def _noted(store: Store, note: str) -> Artifact | None:
    try:
        return store.verify(Artifact(**json.loads(store.read(note))))
    except (StoreError, ValueError, TypeError):
        return None


def _download_or_reuse(
    store: Store, video: WebVideo, chosen: Offer, web: WebConfig, limits: VideoLimits
) -> Artifact:
    """Return the file that another run has downloaded meanwhile, or download it."""
    folder = store.work(f"{video.folder}.{chosen.name}")
    with locked(folder, patience_s=FOR_EVER):
        had = _earlier_download(store, video, chosen)
        made = had if had is not None else _fetched(store, video, chosen, folder, web, limits)
        shutil.rmtree(folder, ignore_errors=True)
    return made


def _fetched(
    store: Store, video: WebVideo, chosen: Offer, folder: Path, web: WebConfig, limits: VideoLimits
) -> Artifact:
    path = fetch(chosen, folder, web, _Progress(video, chosen.name))
    try:
        probed(path, limits)
    except UnreadableVideo:
        path.unlink()
        raise
    made = store.save("video", f"clip.{chosen.name.rsplit('.', 1)[-1]}", path)
    store.put(f"{video.folder}/{chosen.name}{NOTE}", json.dumps(asdict(made)).encode())
    return made


class _Progress:
    """Bytes on the way as lines in the log and, inside a run, as a progress artifact."""

    def __init__(self, video: WebVideo, name: str) -> None:
        self._what = f"{clean_text(video.title, 60) or video.video_id} ({name})"
        self._key = "download-" + hashlib.sha256(video.folder.encode()).hexdigest()[:12]
        self._artifact: Any = None
        self._logged = 0.0
        self._in_run = _in_task()

    def __call__(self, done: int, total: int | None) -> None:
        share = min(done / total, 1.0) if total else 0.0
        if share < self._logged + STEP and share < 1.0:
            return
        if share >= 1.0 and self._logged >= 1.0:
            return
        self._logged = share
        run_logger().info("%s: %.0f %% of %.1f MB", self._what, 100 * share, (total or 0) / 1e6)
        if self._in_run:
            self._show(100 * share)

    def _show(self, percent: float) -> None:
        from prefect.artifacts import create_progress_artifact, update_progress_artifact

        if self._artifact is None:
            label = in_markdown(self._what)
            self._artifact = create_progress_artifact(percent, key=self._key, description=label)
        else:
            update_progress_artifact(self._artifact, percent)


def _in_task() -> bool:
    """Return whether a task of Prefect runs; without one, Prefect is not imported."""
    if "prefect" not in sys.modules:
        return False
    from prefect.context import TaskRunContext

    return TaskRunContext.get() is not None
