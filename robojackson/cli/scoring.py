"""Run Algorithm 1 on videos, without importing Prefect.

The landmarks are those of the detector alone, as in the paper and in a search: the public
`detect_landmarks` also looks for other people and follows the camera, which no score needs.
"""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from robojackson.cli import console
from robojackson.cli.cards import command_line
from robojackson.cli.lifetime.video_process import in_video_process, probed
from robojackson.cli.stages import Figures, Overrides
from robojackson.errors import RoboJacksonError, TrackTooShort, UnreadableVideo
from robojackson.pipeline.yaml_loader import load

if TYPE_CHECKING:
    from robojackson.clips.video import VideoInfo, VideoLimits

UNREADABLE = (UnreadableVideo, TrackTooShort)
"""Errors of one video that do not affect the others."""


def score(videos: list[Path], config: str, overrides: Overrides) -> Figures:
    """Return Algorithm 1's scores of every video; a video without a person is a result, not an
    error.

    A video that cannot be read is reported beside the others' scores; alone it raises an error.
    """
    from robojackson.clips.people.dancer import track_dancer
    from robojackson.clips.pose_detector import detect
    from robojackson.clips.quality.stability import stability
    from robojackson.pipeline.pipeline_config import PipelineConfig

    settings = load(PipelineConfig, config, overrides)
    infos, found = _readable(videos, settings.video)
    finder, which = (track_dancer, (settings.dancer,)) if settings.dancer.number else (detect, ())
    causes: list[RoboJacksonError] = []
    for info in infos:
        video = info.path
        try:
            with console.bar(video.name) as progress:
                track = in_video_process(
                    finder, video, info, settings.scoring_detector, *which,
                    frames=info.frames, progress=progress,
                )  # fmt: skip
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
    found.sort(key=_place)
    return {"videos": found, **_verdict(found)}


def _place(entry: Figures) -> tuple[bool, bool, float]:
    """Sort the steadiest first, then clips without a person, then unreadable ones."""
    return "error" in entry, not entry.get("detected"), entry.get("score_per_second", 0.0)


def _verdict(found: list[Figures]) -> Figures:
    """Return the sentence about the steadiest video, and the next command."""
    best = found[0]
    if not best.get("detected"):
        sentence = "No person is visible in any video: a whole person has to be in view."
        return {"verdict": {"kind": "nobody", "sentence": sentence}}
    name, score = Path(best["video"]).name, best["score_per_second"]
    scored = sum(bool(entry.get("detected")) for entry in found)
    of = "" if scored == 1 else f" of {scored} videos"
    sentence = f"{name} is tracked most steadily{of}: {score:.2f} a second."
    return {
        "verdict": {"kind": "steadiest", "sentence": sentence},
        "next": command_line("dance", best["video"]),
    }


def _readable(
    sources: list[Path], limits: "VideoLimits"
) -> tuple[list["VideoInfo"], list[Figures]]:
    """Return the videos that can be scored, folders expanded, and the errors of the others.

    Raises:
        RoboJacksonError: the first cause, when there is no video left.
    """
    from robojackson.clips.video import list_videos

    infos: list[VideoInfo] = []
    failed: list[Figures] = []
    causes: list[RoboJacksonError] = []
    waiting = list(sources)
    while waiting:
        video = waiting.pop(0)
        try:
            if video.is_dir():
                waiting[:0] = list_videos(video)
            else:
                infos.append(probed(video, limits))
        except RoboJacksonError as cause:
            causes.append(cause)
            failed.append({"video": str(video), "error": str(cause)})
    if causes and not infos:
        raise causes[0]
    return infos, failed
