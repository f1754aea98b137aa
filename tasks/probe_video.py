"""A user's file becomes a video of the store, trimmed on request, and what is known of it."""

import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from robojackson.cli.lifetime.video_process import in_video_process, probed
from robojackson.clips.time_range import span
from robojackson.clips.trim import trim
from robojackson.clips.video import VideoInfo, VideoLimits
from robojackson.files.local_folder import sha256_of_file
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.stage import stage


@dataclass(frozen=True)
class SourceFile:
    """A file outside the store.

    Attributes:
        path: Where it is; not part of what it is.
        sha256: Digest of its content.
    """

    path: Path = field(compare=False)
    sha256: str

    @classmethod
    def at(cls, path: Path) -> "SourceFile":
        """Return the file at a path."""
        return cls(path, sha256_of_file(path))


@stage()
def probe_video(
    source: SourceFile, limits: VideoLimits, start_s: float | None, end_s: float | None
) -> dict[str, Artifact]:
    """Return `video` (the file, or its range) and `info` (size, rate and frames, JSON)."""
    store = Store.from_environment()
    if start_s is None and end_s is None:
        return _save(store, source.path, probed(source.path, limits))
    whole = probed(source.path, replace(limits, max_duration_s=None))
    begin, end = span(whole, limits, start_s, end_s)
    with store.scratch() as folder:
        target = folder / f"{source.path.stem}.mp4"
        in_video_process(trim, source.path, begin, end, target, frames=whole.frames)
        return _save(store, target, replace(probed(target, limits), begin_s=begin))


def info_of(store: Store, info: Artifact, path: Path) -> VideoInfo:
    """Return what `probe` found, with the path at which the video is now."""
    return VideoInfo(path=path, **json.loads(store.read(info.key)))


def _save(store: Store, path: Path, info: VideoInfo) -> dict[str, Artifact]:
    facts = {key: value for key, value in asdict(info).items() if key != "path"}
    return {
        "video": store.save("video", path.name, path),
        "info": store.save("video", "info.json", json.dumps(facts).encode()),
    }
