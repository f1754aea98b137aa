"""A second look at a person who is alone in a clip: closely where he is far away, else in reverse
order where the first pass may have lost limbs."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from robojackson.clips.people.close_up import CloseUpConfig, look_closely
from robojackson.clips.people.reverse_pass import SHORT_SIDE, ReversePassConfig, track_in_reverse
from robojackson.clips.pose_detector import track_of
from robojackson.clips.video import VideoInfo, timed_frames
from robojackson.motion.landmark_track import LandmarkTrack


def look_again(
    path: Path,
    info: VideoInfo,
    size: str,
    single: LandmarkTrack,
    close_up: CloseUpConfig,
    reverse: ReversePassConfig,
    progress: Callable[[int, int], None] | None = None,
) -> LandmarkTrack:
    """Return the track of a person who is alone, looked at again where that shows more of him.

    Args:
        path: Video file.
        info: What `probe` found in it.
        size: lite, full or heavy.
        single: What the detector found in the order of the clip.
        close_up, reverse: When and how to look again.
        progress: Called with (frames done, frames in all).
    """
    depth = (single.landmarks, single.world_landmarks, single.visibility[..., None])
    first = np.concatenate(depth, -1)
    rows = look_closely(path, info, size, first, close_up, progress)
    if rows is not None:
        notes = ("the person is small in the picture: looked at closely",)
        return track_of(rows, single.times, info, notes=notes)
    images = (image for _, image in timed_frames(path, short_side=SHORT_SIDE))
    shape = (info.width, info.height)
    rows, used = track_in_reverse(images, info.fps, shape, size, first, reverse, progress)
    if not used:
        return single
    frames = f"{used} of {len(first)} frames"
    notes = (f"{frames} tracked in reverse order: limbs were lost in the order of the clip",)
    return track_of(rows, single.times, info, notes=notes)
