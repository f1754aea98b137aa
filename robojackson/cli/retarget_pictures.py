"""Pictures of a retargeting, from files to files: a video, contacts, torques, feasibility."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from robojackson.files.file_tree import FileTree
from robojackson.pipeline.yaml_loader import load

VIDEO, CONTACTS, TORQUES = "retarget.mp4", "contacts.png", "torques.png"
FEASIBILITY = "feasibility.png"


def draw_retargeting(
    smpl: Path, out: Path, config: str, overrides: Mapping[str, Any]
) -> dict[str, Any]:
    """Draw what `stages.retarget` wrote into a folder, beside the person it was made from.

    Raises:
        MissingDependency: no way to draw without a screen.
    """
    from robojackson.api.arguments import robot_of
    from robojackson.api.evaluation import render_video
    from robojackson.motion.reference_motion import ReferenceMotion
    from robojackson.motion.smpl_sequence import SmplSequence
    from robojackson.pipeline.pipeline_config import PipelineConfig
    from robojackson.report.plots import run_plots
    from robojackson.report.plots.feasibility_plot import feasibility_strip

    settings = load(PipelineConfig, config, overrides)
    sequence = SmplSequence.load(smpl)
    reference = ReferenceMotion.load(out / "reference.parquet")
    robot = robot_of(reference)
    motors = [name for name, moved in zip(robot.joint_names, robot.actuated, strict=True) if moved]
    files = FileTree(out)
    files.write(CONTACTS, run_plots.png(run_plots.contact_strip(sequence, reference)))
    files.write(TORQUES, run_plots.png(run_plots.torque_heat_map(reference, motors)))
    drawn = {"contacts": str(out / CONTACTS), "torques": str(out / TORQUES)}
    if reference.certificate is not None:
        files.write(FEASIBILITY, run_plots.png(feasibility_strip(reference)))
        drawn["feasibility"] = str(out / FEASIBILITY)
    render_video(
        out / VIDEO, reference, motion=sequence, robot=robot, config=settings.render, progress=True
    )
    return {"video": str(out / VIDEO), **drawn}
