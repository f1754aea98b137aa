"""The video of a retargeting: the person's skeleton beside the robot that shall do the same.

Both panels show the same moment, from cameras that stand in front (+x) and follow over the floor.
"""

from collections.abc import Callable, Iterator
from pathlib import Path

import mujoco
import numpy as np

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video import canvas
from robojackson.report.video.encoder import write_video
from robojackson.report.video.robot_panel import REFERENCE_TINT, RobotView
from robojackson.report.video.side_by_side import VideoConfig
from robojackson.report.video.skeleton_panel import skeleton_panel, smooth_camera_path, view_of
from robojackson.report.video.timeline import Timeline, reference_qpos, timeline


def human_beside_robot(
    sequence: SmplSequence,
    reference: ReferenceMotion,
    out: Path,
    *,
    model: mujoco.MjModel,
    config: VideoConfig | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write the mp4: one cycle, or the whole motion, up to the configuration's length.

    Args:
        model: The robot that the reference was made for.
        progress: Called with (pictures done, pictures in all).
    Raises:
        MissingDependency: no way to draw without a screen.
    """
    config = config or VideoConfig()
    fps = float(config.fps)
    when = timeline(reference, sequence.fps, len(sequence), 0, fps, config.max_seconds)
    size = config.panel_width, config.panel_height
    with RobotView(model, *size, REFERENCE_TINT) as robot:
        pairs = _pairs(sequence, reference_qpos(reference, when), when, robot, config)
        return write_video(
            _with_progress(pairs, len(when), progress), config.fps, out, config.quality
        )


def _pairs(
    sequence: SmplSequence,
    qpos: np.ndarray,
    when: Timeline,
    robot: RobotView,
    config: VideoConfig,
) -> Iterator[canvas.Picture]:
    size = config.panel_width, config.panel_height
    person_at = smooth_camera_path(sequence.keypoints_w[when.frame, 0], float(config.fps))
    robot_at = smooth_camera_path(qpos[:, :3], float(config.fps))
    for index, frame in enumerate(map(int, when.frame)):
        view = view_of(person_at[index], config.azimuth_deg, *size)
        person = skeleton_panel(sequence, frame, view, *size)
        canvas.label(person, "motion capture", "" if sequence.valid[frame] else "(filled in)")
        posed = robot.picture(qpos[index], robot_at[index], config.azimuth_deg)
        canvas.label(posed, "reference robot", f"{when.time_s[index]:.1f} s")
        yield canvas.side_by_side([person, posed])


def _with_progress(
    pictures: Iterator[canvas.Picture], total: int, progress: Callable[[int, int], None] | None
) -> Iterator[canvas.Picture]:
    for done, picture in enumerate(pictures, start=1):
        yield picture
        if progress:
            progress(done, total)
