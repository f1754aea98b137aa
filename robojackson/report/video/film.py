"""Panels side by side at the same moments, one picture a moment; panels are added one by one.

The cameras have the direction of the one that filmed, in front (+x), follow their subject over the
floor, and are so far away that no subject leaves a panel in the whole film; all are equally far, so
that sizes can be compared.
"""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Literal

import mujoco
import numpy as np
from jaxtyping import Float
from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video import canvas
from robojackson.report.video.panel_camera import Framing, Subject, fit, smooth_camera_path, view_of
from robojackson.report.video.robot_extent import room_of
from robojackson.report.video.robot_scene import Tint
from robojackson.report.video.skeleton_panel import skeleton_panel
from robojackson.report.video.source_panel import SourceClip
from robojackson.report.video.threaded_view import BeginPicture, threaded_view
from robojackson.report.video.timeline import Timeline, person_points

Drawn = Callable[[], canvas.Picture]
Begin = Callable[[int, Framing], Drawn]
"""Function that begins to draw the picture of a moment, by its index, through a camera, and returns
a function that waits for it."""
AHEAD = 2
"""Moments that are begun before the present one is encoded."""
FLOOR = np.array([1.0, 1.0, 0.0])
SIDE_DEG = 90.0
"""Direction from which the left side is visible."""


@config_dataclass
class VideoConfig:
    """Appearance of the video.

    Attributes:
        fps: Pictures a second.
        panel_width, panel_height: Pixels of one panel, even.
        max_seconds: Longest video, seconds; as `video.max_duration_s`, so that a dance is shown
            whole.
        azimuth_deg: Rotation of the cameras around the subject; 0 is the front.
        quality: Constant rate factor of H.264; lower is better and larger.
        music: Path of music that replaces the clip's own sound.
        shape: All panels in a row; or dancer and robot, square, vertical (9:16) or wide (16:9),
            1080 pixels at the shorter side.
        alone: Whether such a video shows the robot without the dancer.
    """

    fps: int = Field(default=30, ge=1)
    panel_width: int = Field(default=320, ge=64, multiple_of=2)
    panel_height: int = Field(default=480, ge=64, multiple_of=2)
    max_seconds: float = Field(default=60.0, gt=0.0)
    azimuth_deg: float = 0.0
    quality: int = Field(default=20, ge=0, le=51)
    music: str = ""
    shape: Literal["row", "square", "vertical", "wide"] = "row"
    alone: bool = False


SIZES = {"square": (1080, 1080), "vertical": (1080, 1920), "wide": (1920, 1080)}
"""Size of a whole picture, pixels."""


def panels_of(config: VideoConfig, count: int) -> VideoConfig:
    """Return the configuration with the panels' size that fills its shape."""
    if config.shape == "row":
        return config
    width, height = SIZES[config.shape]
    across, down = (1, count) if config.shape == "vertical" else (count, 1)
    return replace(config, panel_width=width // across, panel_height=height // down)


class Film:
    """The panels of one film.

    Args:
        stack: Closes the resources of the graphics driver.
        when: The moments.
        still: Whether the moments are far apart, so that no camera follows from one to the next.
    """

    def __init__(
        self, stack: ExitStack, config: VideoConfig, when: Timeline, still: bool = False
    ) -> None:
        self._stack, self._config, self._when, self._still = stack, config, when, still
        self._size = config.panel_width, config.panel_height
        self._panels: list[Begin] = []
        self._subjects: list[Subject] = []
        self._views: dict[tuple[int, Tint], BeginPicture] = {}

    def add_source(
        self, source: Path, track: LandmarkTrack, sequence: SmplSequence | None, plain: bool
    ) -> None:
        """Add the clip with its landmarks or skeleton, and optionally the plain clip.

        Args:
            sequence: Motion that is drawn over the clip; None draws the landmarks.
            plain: Whether to add the plain clip, too.
        """
        clip = SourceClip(source, track, sequence, self._when.frame, *self._size)
        if plain:
            self._panels.append(
                lambda index, framing: partial(self._clip, index, "source", clip.plain)
            )
        drawn = clip.with_landmarks if sequence is None else clip.with_skeleton
        title = "source" if sequence is None else "skeleton over source"
        self._panels.append(lambda index, framing: partial(self._clip, index, title, drawn))

    def add_body(
        self, sequence: SmplSequence, title: str = "motion capture", turn_deg: float = 0.0
    ) -> None:
        """Add the recovered skeleton, from the front or rotated by `turn_deg` to its left."""
        frames = np.minimum(self._when.frame, len(sequence) - 1)
        points = person_points(sequence, self._when)
        target, azimuth = self._followed(points[:, 0]), self._config.azimuth_deg + turn_deg
        around = points - np.pad(target, ((0, 0), (0, 1)))[:, None]
        room = np.concatenate([around, around * FLOOR]).reshape(-1, 3)
        self._subjects.append(Subject(room, azimuth))

        def draw(index: int, framing: Framing) -> canvas.Picture:
            view = view_of(target[index], azimuth, *self._size, framing)
            contact = sequence.contact[frames[index]]
            panel = skeleton_panel(points[index], contact, view, *self._size)
            canvas.label(panel, title, "" if sequence.valid[frames[index]] else "(filled in)")
            return panel

        self._panels.append(lambda index, framing: partial(draw, index, framing))

    def add_robot(
        self,
        title: str,
        qpos: Float[np.ndarray, "N nq"],
        model: mujoco.MjModel,
        tint: Tint,
        turn_deg: float = 0.0,
        is_rollout: bool = False,
    ) -> None:
        """Add a robot at every moment; a rollout has an end."""
        key = (id(model), tint)
        if key not in self._views:
            view = threaded_view(model, *self._size, tint)
            self._views[key] = self._stack.enter_context(view)
        begin_picture = self._views[key]
        target, azimuth = self._followed(qpos[:, :3]), self._config.azimuth_deg + turn_deg
        self._subjects.append(Subject(room_of(model, qpos, target), azimuth))

        def labelled(index: int, drawn: Drawn) -> canvas.Picture:
            panel = drawn()
            over = is_rollout and bool(self._when.ended[index])
            canvas.label(panel, title, "ended" if over else f"{self._when.time_s[index]:.1f} s")
            return panel

        def begin(index: int, framing: Framing) -> Drawn:
            drawn = begin_picture(qpos[index], target[index], azimuth, framing)
            return partial(labelled, index, drawn)

        self._panels.append(begin)

    def moments(self) -> Iterator[list[canvas.Picture]]:
        """Yield the panels of each moment, in the order in which they were added."""
        framing, begun = fit(self._subjects, *self._size), deque[list[Drawn]]()
        for index in range(len(self._when)):
            begun.append([begin(index, framing) for begin in self._panels])
            if len(begun) > AHEAD:
                yield [drawn() for drawn in begun.popleft()]
        for moment in begun:
            yield [drawn() for drawn in moment]

    def pictures(self) -> Iterator[canvas.Picture]:
        """Yield the panels of each moment in a row; one above the other in a vertical film."""
        if self._config.shape == "vertical":
            return map(np.concatenate, self.moments())
        gap = 2 if self._config.shape == "row" else 0
        return (canvas.side_by_side(panels, gap) for panels in self.moments())

    def sheet(self) -> canvas.Picture:
        """Return one picture: a column a moment, a row a panel."""
        columns = [np.concatenate(panels) for panels in self.moments()]
        return canvas.side_by_side(columns)

    def _clip(
        self, index: int, title: str, drawn: Callable[[int], canvas.Picture]
    ) -> canvas.Picture:
        frame = int(self._when.frame[index])
        panel = drawn(frame)
        canvas.label(panel, title, f"frame {frame}")
        return panel

    def _followed(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 2"]:
        if self._still:
            return np.asarray(points[:, :2], float)
        return smooth_camera_path(points, float(self._config.fps))
