"""The range of a video that a user means."""

from dataclasses import replace
from math import ceil

from robojackson.clips.video import VideoInfo, VideoLimits, require_within
from robojackson.errors import BadConfiguration

ROUNDING = 1e-6
"""Share of a frame that seconds times a rate are off."""


def span(
    info: VideoInfo, limits: VideoLimits, start_s: float | None, end_s: float | None
) -> tuple[float, float]:
    """Return the range of a video that is meant, seconds; an end beyond the video is the video's.

    Raises:
        BadConfiguration: nothing, or a single frame, is in it.
        VideoTooLong: it is longer than the limit.
    """
    begin = start_s or 0.0
    end = info.duration_s if end_s is None else min(end_s, info.duration_s)
    if begin >= info.duration_s:
        raise BadConfiguration(
            f"{info.path}: {info.duration_s:.2f} s long: nothing is shown from {begin:g} s on"
        )
    if begin >= end:
        raise BadConfiguration(
            f"{info.path}: no range from {begin:g} s to {end:g} s in {info.duration_s:.2f} s"
        )
    frames = ceil((end - begin) * info.fps - ROUNDING)
    if frames < limits.min_frames <= info.frames:
        raise BadConfiguration(
            f"{info.path}: {frames} frame from {begin:g} s to {end:g} s, at least "
            f"{limits.min_frames} are needed: choose a longer range"
        )
    require_within(replace(info, duration_s=end - begin), limits)
    return begin, end
