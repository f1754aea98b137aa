"""Algorithm 1 for the videos that a user names, with no Prefect in memory."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from robojackson.cli import console
from robojackson.cli.stages import Figures, Overrides
from robojackson.errors import RoboJacksonError, TrackTooShort, UnreadableVideo
from robojackson.pipeline.yaml_loader import load

if TYPE_CHECKING:
    from robojackson.clips.video import VideoInfo, VideoLimits

UNREADABLE = (UnreadableVideo, TrackTooShort)
"""What is one video's fault and not of all."""


def score(videos: list[Path], config: str, overrides: Overrides) -> Figures:
    """Algorithm 1 for every video; one without a person is an answer, not an error.

    One that cannot be read is told beside the others' scores, and is an error where it is alone.
    """
    from robojackson.clips.people.dancer import track_dancer
    from robojackson.clips.pose_detector import detect
    from robojackson.clips.quality.stability import stability
    from robojackson.pipeline.pipeline_config import PipelineConfig

    settings = load(PipelineConfig, config, overrides)
    infos, found = _readable(videos, settings.video)
    causes: list[RoboJacksonError] = []
    for info in infos:
        video = info.path
        try:
            with console.bar(video.name) as progress:
                if settings.dancer.number:
                    which = settings.dancer
                    track = track_dancer(video, info, settings.scoring_detector, which, progress)
                else:
                    track = detect(video, info, settings.scoring_detector, progress)
        except UNREADABLE as cause:
            causes.append(cause)
            found.append({"video": str(video), "error": str(cause)})
            continue
        scored = stability(track, settings.stability)
        found.append({"video": str(video), "fps": info.fps, **asdict(scored)})
        if not scored.detected:
            found[-1]["note"] = f"no person found in {len(track)} of {len(track)} frames"
    if causes and len(causes) == len(infos):
        raise causes[0]
    return {"videos": found}


def _readable(
    sources: list[Path], limits: "VideoLimits"
) -> tuple[list["VideoInfo"], list[Figures]]:
    """The videos that can be scored, folders expanded, and what is wrong with the others.

    Raises:
        RoboJacksonError: the first cause, when there is no video left.
    """
    from robojackson.clips.video import list_videos, probe

    infos: list[VideoInfo] = []
    told: list[Figures] = []
    causes: list[RoboJacksonError] = []
    waiting = list(sources)
    while waiting:
        video = waiting.pop(0)
        try:
            if video.is_dir():
                waiting[:0] = list_videos(video)
            else:
                infos.append(probe(video, limits))
        except RoboJacksonError as cause:
            causes.append(cause)
            told.append({"video": str(video), "error": str(cause)})
    if causes and not infos:
        raise causes[0]
    return infos, told
