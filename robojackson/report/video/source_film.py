"""The source pane of a page as its own film, one picture a moment of the player."""

import tempfile
from pathlib import Path

from robojackson.clips.sound import Sound
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.report.video.encoder import write_video
from robojackson.report.video.film import VideoConfig
from robojackson.report.video.source_panel import SourceClip
from robojackson.report.video.timeline import Timeline

QUALITY = 24
"""Constant rate factor: the film is inside the page."""


def source_film(
    source: Path,
    track: LandmarkTrack,
    when: Timeline,
    config: VideoConfig,
    sound: Sound | None = None,
) -> bytes:
    """Return an mp4 whose picture k is moment k, with fast access to any picture."""
    size = config.panel_width, config.panel_height
    clip = SourceClip(source, track, None, when.frame, *size)
    pictures = (clip.with_landmarks(int(frame)) for frame in when.frame)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "source.mp4"
        write_video(pictures, config.fps, path, QUALITY, sound=sound, seekable=True)
        return path.read_bytes()
