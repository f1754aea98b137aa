"""Pictures of a retargeting, from files to files: a sheet of poses; optionally a video and plots of
contacts, torques and feasibility.
"""

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from robojackson.cli.pictures.motion_source import source_of
from robojackson.errors import MissingDependency
from robojackson.files.file_tree import FileTree
from robojackson.pipeline.yaml_loader import load

if TYPE_CHECKING:
    from robojackson.motion.reference_motion import ReferenceMotion
    from robojackson.motion.smpl_sequence import SmplSequence
    from robojackson.robot.model import Robot

PICTURE, VIDEO, CONTACTS, TORQUES = "retarget.png", "retarget.mp4", "contacts.png", "torques.png"
FEASIBILITY = "feasibility.png"

log = logging.getLogger(__name__)


def draw_poses(smpl: Path, out: Path) -> dict[str, str]:
    """Draw the sheet of the results of `stages.retarget`; nothing without graphics."""
    from robojackson.api.arguments import robot_of
    from robojackson.motion.reference_motion import ReferenceMotion
    from robojackson.motion.smpl_sequence import SmplSequence
    from robojackson.report.video.still_picture import robot_poses

    reference = ReferenceMotion.load(out / "reference.parquet")
    found = source_of(smpl)
    video, track = (found.video, found.track) if found else (None, None)
    model = robot_of(reference).model
    try:
        sheet = robot_poses(video, track, SmplSequence.load(smpl), reference, model)
    except MissingDependency as cause:
        log.warning("no picture: %s", cause)
        return {}
    FileTree(out).write(PICTURE, sheet)
    return {"picture": str(out / PICTURE)}


def draw_retargeting(
    smpl: Path, out: Path, config: str, overrides: Mapping[str, object]
) -> dict[str, str]:
    """Draw the results of `stages.retarget` beside the person they were made from.

    Raises:
        MissingDependency: no way to draw without a screen.
    """
    from robojackson.api.arguments import robot_of
    from robojackson.api.evaluation import render_video
    from robojackson.motion.reference_motion import ReferenceMotion
    from robojackson.motion.smpl_sequence import SmplSequence
    from robojackson.pipeline.pipeline_config import PipelineConfig

    settings = load(PipelineConfig, config, overrides)
    sequence = SmplSequence.load(smpl)
    reference = ReferenceMotion.load(out / "reference.parquet")
    robot = robot_of(reference)
    drawn = _plots(sequence, reference, robot, out)
    found = source_of(smpl)
    video, track = (found.video, found.track) if found else (None, None)
    render_video(
        out / VIDEO, reference, motion=sequence, video=video, landmarks=track, robot=robot,
        config=settings.render, plain=True, progress=True,
    )  # fmt: skip
    return {"video": str(out / VIDEO), **drawn}


def _plots(
    sequence: "SmplSequence", reference: "ReferenceMotion", robot: "Robot", out: Path
) -> dict[str, str]:
    from robojackson.report.plots import run_plots
    from robojackson.report.plots.feasibility_plot import feasibility_strip

    figures = {
        CONTACTS: run_plots.contact_strip(sequence, reference),
        TORQUES: run_plots.torque_heat_map(reference, reference.joint_names),
    }
    if reference.certificate is not None:
        figures[FEASIBILITY] = feasibility_strip(reference)
    for name, figure in figures.items():
        FileTree(out).write(name, run_plots.png(figure))
    return {Path(name).stem: str(out / name) for name in figures}
