"""The video that proves it: source, skeleton, reference robot and trained robot side by side.

Each panel is there when it is given. All show the same moment. The cameras stand where the one that
filmed stood, in front (+x), and follow their subject over the floor.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float
from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video import canvas
from robojackson.report.video.encoder import write_video
from robojackson.report.video.robot_panel import REFERENCE_TINT, TRAINED_TINT, RobotView, Tint
from robojackson.report.video.skeleton_panel import skeleton_panel, smooth_camera_path, view_of
from robojackson.report.video.source_panel import source_panels
from robojackson.report.video.timeline import Timeline, reference_qpos, timeline

Progress = Callable[[int, int], None]


@config_dataclass
class VideoConfig:
    """How the video looks.

    Attributes:
        fps: Pictures a second.
        panel_width, panel_height: Pixels of one panel, even.
        max_seconds: Longest video, seconds.
        azimuth_deg: How far the cameras go around the subject; 0 is the front.
        quality: Constant rate factor of H.264; lower is better and larger.
    """

    fps: int = Field(default=30, ge=1)
    panel_width: int = Field(default=320, ge=64, multiple_of=2)
    panel_height: int = Field(default=480, ge=64, multiple_of=2)
    max_seconds: float = Field(default=20.0, gt=0.0)
    azimuth_deg: float = 0.0
    quality: int = Field(default=20, ge=0, le=51)


def side_by_side(
    source: Path | None,
    track: LandmarkTrack | None,
    sequence: SmplSequence | None,
    reference: ReferenceMotion,
    rollout_qpos: Float[np.ndarray, "S nq"] | None,
    out: Path,
    *,
    model: mujoco.MjModel,
    config: VideoConfig | None = None,
    progress: Progress | None = None,
) -> Path:
    """Write the mp4; what is None has no panel.

    Args:
        source, track: The clip and the landmarks that were found in it; both or neither.
        sequence: The motion of the person.
        rollout_qpos: The trained robot at the reference's control step, from its first step on;
            may be longer than a cycle, and ends where the robot fell.
        model: The robot that qpos belongs to.
        progress: Called with (pictures done, pictures in all).
    Raises:
        MissingDependency: no way to draw without a screen.
    """
    config = config or VideoConfig()
    steps = 0 if rollout_qpos is None else len(rollout_qpos)
    filmed = [each for each in (track, sequence) if each is not None]
    fps, frames = (filmed[0].fps, len(filmed[-1])) if filmed else (1.0, 1)
    when = timeline(reference, fps, frames, steps, float(config.fps), config.max_seconds)
    with ExitStack() as stack:
        film = Film(stack, source, track, sequence, config, when)
        film.add_robot("reference", reference_qpos(reference, when), model, REFERENCE_TINT)
        if rollout_qpos is not None and steps:
            film.add_robot("trained", rollout_qpos[when.rollout], model, TRAINED_TINT)
        pictures = _with_progress(film.pictures(), len(when), progress)
        return write_video(pictures, config.fps, out, config.quality)


class Film:
    """The panels of one video; robots are added one by one."""

    def __init__(
        self,
        stack: ExitStack,
        source: Path | None,
        track: LandmarkTrack | None,
        sequence: SmplSequence | None,
        config: VideoConfig,
        when: Timeline,
    ) -> None:
        self._stack, self._config, self._when, self._sequence = stack, config, when, sequence
        self._size = config.panel_width, config.panel_height
        self._sources: dict[int, canvas.Picture] | None = None
        if source is not None and track is not None:
            self._sources = source_panels(source, track, when.frame, *self._size)
        if sequence is not None:
            self._skeleton_target = self._followed(sequence.keypoints_w[when.frame, 0])
        self._robots: list[tuple[str, RobotView, np.ndarray, np.ndarray]] = []

    def add_robot(
        self,
        title: str,
        qpos: Float[np.ndarray, "N nq"],
        model: mujoco.MjModel,
        tint: Tint,
    ) -> None:
        view = self._stack.enter_context(RobotView(model, *self._size, tint))
        self._robots.append((title, view, qpos, self._followed(qpos[:, :3])))

    def pictures(self) -> Iterator[canvas.Picture]:
        for index in range(len(self._when)):
            panels = [] if self._sources is None else [self._source(index, self._sources)]
            panels += [] if self._sequence is None else [self._skeleton(index, self._sequence)]
            panels += [self._robot(index, *robot) for robot in self._robots]
            yield canvas.side_by_side(panels)

    def _source(self, index: int, sources: Mapping[int, canvas.Picture]) -> canvas.Picture:
        frame = int(self._when.frame[index])
        blank = np.full((self._size[1], self._size[0], 3), canvas.BACKDROP, np.uint8)
        panel = sources.get(frame, blank).copy()
        canvas.label(panel, "source", f"frame {frame}")
        return panel

    def _skeleton(self, index: int, sequence: SmplSequence) -> canvas.Picture:
        frame = min(int(self._when.frame[index]), len(sequence) - 1)
        view = view_of(self._skeleton_target[index], self._config.azimuth_deg, *self._size)
        panel = skeleton_panel(sequence, frame, view, *self._size)
        canvas.label(panel, "motion capture", "" if sequence.valid[frame] else "(filled in)")
        return panel

    def _robot(
        self, index: int, title: str, view: RobotView, qpos: np.ndarray, target: np.ndarray
    ) -> canvas.Picture:
        panel = view.picture(qpos[index], target[index], self._config.azimuth_deg)
        trained = title == "trained"
        over = trained and bool(self._when.ended[index])
        note = "ended" if over else f"{self._when.time_s[index]:.1f} s"
        canvas.label(panel, f"{title} robot", note)
        return panel

    def _followed(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 2"]:
        return smooth_camera_path(points, float(self._config.fps))


def _with_progress(
    pictures: Iterator[canvas.Picture], total: int, progress: Progress | None
) -> Iterator[canvas.Picture]:
    for done, picture in enumerate(pictures, start=1):
        yield picture
        if progress:
            progress(done, total)
