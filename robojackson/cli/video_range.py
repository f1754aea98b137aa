"""The range of a video that a command is given, as a file beside the results."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from robojackson.cli.lifetime.video_process import in_video_process, probed
from robojackson.clips.time_range import span
from robojackson.clips.trim import trim
from robojackson.errors import BadConfiguration
from robojackson.files.file_tree import results_in
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.yaml_loader import load


@contextmanager
def video_range(
    video: Path,
    second: Path | None,
    out: Path,
    range_s: tuple[float | None, float | None],
    config: str,
    overrides: Mapping[str, Any],
    kept: bool = True,
) -> Iterator[Path]:
    """Yield the video, or the file of its range in `out`, which goes again if the block fails.

    Args:
        second: Another camera; two videos have no common range before they are synchronised.
        range_s: First and last moment, seconds; None is the video's.
        kept: Whether the file stays for the results, which are about it.
    Raises:
        BadConfiguration: nothing is in the range, or there are two cameras.
        RoboJacksonError: the video cannot be read.
    """
    if range_s == (None, None):
        yield video
        return
    if second is not None:
        raise BadConfiguration("two cameras exclude --start and --end: omit these options")
    limits = load(PipelineConfig, config, overrides).video
    whole = probed(video, replace(limits, max_duration_s=None))
    begin, end = span(whole, limits, *range_s)
    was_there = out.exists()
    with results_in(out):
        out.mkdir(parents=True, exist_ok=True)
    target = out / f"{video.stem}-{begin:g}-{end:g}s.mp4"
    made = not target.exists()
    try:
        in_video_process(trim, video, begin, end, target, frames=whole.frames)
        yield target
        if made and not kept:
            target.unlink(missing_ok=True)
    except BaseException:
        if made:  # not that of an earlier run, whose results are about it
            target.unlink(missing_ok=True)
        if not was_there and not any(out.iterdir()):
            out.rmdir()
        raise
