"""Resolve the SOURCE of a dance: a file, a folder, an address, or the name of a dance."""

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robojackson.clips.video import SUFFIXES
from robojackson.clips.web.untrusted_text import web_address
from robojackson.errors import RoboJacksonError, UnreadableVideo
from robojackson.pipeline.robot_descriptions import describe_robot

if TYPE_CHECKING:
    from robojackson.pipeline.pipeline_config import PipelineConfig

from robojackson.pipeline.bundled_clips import bundled

DEFAULT = "hip_shake.mp4"
LONGEST = 1000
"""Of a path or a name, bytes."""


def resolve(source: str | None) -> Path:
    """Return the file or folder that a user means; without one, the bundled hip shake.

    Raises:
        UnreadableVideo: it looks like a path and is not there, or it is the name of a dance.
        MissingDependency: the bundled clips are not here.
    """
    if source is None:
        return bundled(DEFAULT)
    _require_name(source)
    path = Path(source)
    if path.exists():
        return path
    if os.sep in source or path.suffix.lower() in SUFFIXES:
        raise UnreadableVideo(f"{source}: no such file or folder")
    raise UnreadableVideo(
        f"{source!r} is no file but the name of a dance: `robojackson find` looks for its videos"
    )


def is_name(source: str | None) -> bool:
    """Return whether a SOURCE is the name of a dance: no path, and nothing that looks like one."""
    if source is None:
        return False
    _require_name(source)
    if Path(source).exists():
        return False
    return os.sep not in source and Path(source).suffix.lower() not in SUFFIXES


def is_on_the_web(source: str | None) -> bool:
    """Return whether a SOURCE has to be downloaded: the name of a dance, or a video's address."""
    return is_name(source) or bool(web_address(source))


def _require_name(source: str) -> None:
    if not source.strip():
        raise UnreadableVideo("SOURCE is empty: give a video, a folder or the name of a dance")
    if len(source.encode(errors="replace")) > LONGEST:
        raise UnreadableVideo(f"{source[:40]}...: too long for a path or the name of a dance")


def load_settings(config: str, overrides: Mapping[str, Any]) -> "PipelineConfig":
    """Return the configuration, checked with its robot before anything costly starts.

    Raises:
        BadConfiguration, UnknownName: it cannot be used.
    """
    from robojackson.pipeline.pipeline_config import PipelineConfig
    from robojackson.pipeline.tracker_descriptions import require_tracker
    from robojackson.pipeline.yaml_loader import load
    from robojackson.rl.sim.trainable import require_trainable
    from robojackson.robot.model import load_robot

    settings = load(PipelineConfig, config, overrides)
    robot = describe_robot(settings.robot)
    if settings.instant:  # first: there is no use in adding a robot that has none
        require_tracker(robot.name, settings.tracker)
    require_trainable(load_robot(robot), settings.train)
    return settings


def require_music(settings: "PipelineConfig") -> None:
    """Raise what the flow would raise after the training: the music cannot be heard."""
    from robojackson.cli.lifetime.video_process import in_video_process
    from robojackson.clips.sound import require_audible

    if settings.render.music:
        in_video_process(require_audible, Path(settings.render.music))


def require_usable(
    source: Path, settings: "PipelineConfig", start_s: float | None, end_s: float | None
) -> None:
    """Raise what the flow would raise much later: no video of the source can be danced."""
    from robojackson.cli.lifetime.video_process import probed
    from robojackson.clips.time_range import span
    from robojackson.clips.video import list_videos

    limits = settings.video
    trims = start_s is not None or end_s is not None
    allowed = replace(limits, max_duration_s=None) if trims else limits
    causes = []
    for path in list_videos(source):
        try:
            span(probed(path, allowed), limits, start_s, end_s)
            return
        except RoboJacksonError as cause:
            causes.append(cause)
    raise causes[0]
