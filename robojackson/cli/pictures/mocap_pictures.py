"""Pictures of a recovered motion, from files to files: a sheet always, a video on request."""

from collections.abc import Mapping
from pathlib import Path

from robojackson.files.file_tree import FileTree
from robojackson.pipeline.yaml_loader import load

PICTURE, VIDEO = "mocap.png", "mocap.mp4"


def draw_mocap(
    video: Path,
    out: Path,
    config: str,
    overrides: Mapping[str, object],
    film: bool,
    start_s: float | None = None,
) -> dict[str, object]:
    """Draw what `stages.mocap` wrote into a folder: over the source, from the front, from the side;
    and return how far the body lies off the source.

    Args:
        film: Whether to render a video, too.
        start_s: Where the clip begins in the video that was given: all moments are of that.
    """
    from robojackson.api.progress_bar import bar
    from robojackson.mocap.reprojection import reprojection_record
    from robojackson.motion.landmark_track import LandmarkTrack
    from robojackson.motion.smpl_sequence import SmplSequence
    from robojackson.pipeline.pipeline_config import PipelineConfig
    from robojackson.report.video.side_by_side import body_video
    from robojackson.report.video.still_picture import body_sheet

    track = LandmarkTrack.load(out / "landmarks.parquet")
    sequence = SmplSequence.load(out / "smpl.parquet")
    FileTree(out).write(PICTURE, body_sheet(video, track, sequence))
    drawn = {"picture": str(out / PICTURE), **reprojection_record(sequence, track, start_s or 0.0)}
    if film:
        settings = load(PipelineConfig, config, overrides)
        with bar(VIDEO) as progress:
            body_video(video, track, sequence, out / VIDEO, settings.render, progress)
        drawn["film"] = str(out / VIDEO)
    return drawn
