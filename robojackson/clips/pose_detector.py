"""The pose detector: MediaPipe PoseLandmarker over every frame of a clip, in VIDEO mode.

The model bundles are files of this package (`robojackson/assets`); "heavy" is built on request.
"""

import ctypes
import logging
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from robojackson.clips.video import VideoInfo, timed_frames
from robojackson.errors import MissingDependency, UnknownName
from robojackson.motion.landmark_track import LANDMARKS, LandmarkTrack, uneven

Size = Literal["lite", "full", "heavy"]
Watcher = Callable[[int, np.ndarray, np.ndarray], None]
"""Called with the number of a frame, its RGB image and its row (33, 7): image xyz, world xyz,
visibility; NaN where no person was detected."""
SIZES: tuple[str, ...] = ("lite", "full", "heavy")
ASSETS = Path(__file__).parent.parent / "assets"
BUILDING = (
    "build it: python -m tools.assets.build_pose_models --size {size}"
    if (ASSETS.parents[1] / "tools").is_dir()
    else "it is built in a checkout of the repository alone: take another quality"
)
GRAPHICS_LIBRARIES = ("libEGL.so.1", "libGLESv2.so.2")
GRAPHICS_INSTALL = (
    "apt-get install --no-install-recommends libegl1 libgles2 libopengl0 libgl1-mesa-dri"
)

SHORT_SIDE = 1080
"""Pixels: larger pictures are made smaller, the detector looks at 256 of them."""

log = logging.getLogger(__name__)


def model_path(size: str) -> Path:
    """Return the bundle of one size.

    Raises:
        UnknownName: no such size.
        MissingDependency: the bundle is missing; the message is the command that installs it.
    """
    if size not in SIZES:
        raise UnknownName("pose model", size, "clips.pose_detector", SIZES)
    path = ASSETS / f"pose_landmarker_{size}.task"
    if not path.is_file():
        raise MissingDependency(f"{path.name} is not installed; {BUILDING.format(size=size)}")
    return path


def missing_graphics_libraries() -> tuple[str, ...]:
    """Return the shared libraries that MediaPipe links to and this machine lacks."""
    return tuple(name for name in GRAPHICS_LIBRARIES if not _loads(name))


def detect(
    path: Path,
    info: VideoInfo,
    size: str = "full",
    progress: Callable[[int, int], None] | None = None,
    watch: Watcher | None = None,
) -> LandmarkTrack:
    """Return landmarks of the most prominent person, NaN rows where no person is found.

    Args:
        path: Video file.
        info: What `probe` found in it.
        size: lite, full or heavy.
        progress: Called with (frames done, frames in all) after every frame.
        watch: Called with every frame too, so that a clip is decoded once.
    Raises:
        MissingDependency: no model bundle, or no EGL and GLES libraries.
    """
    with video_landmarker(size) as detect_frame:
        rows, times = [], []
        for index, (time_s, image) in enumerate(timed_frames(path, short_side=SHORT_SIDE)):
            rows.append(detect_frame(image, time_s if info.uneven else index / info.fps))
            times.append(time_s)
            if watch:
                watch(index, image, rows[-1])
            if progress:
                progress(index + 1, info.frames)
    return track_of(np.array(rows), np.array(times), info)


def track_of(
    rows: Float[np.ndarray, "T 33 7"],
    time_s: Float[np.ndarray, " T"],
    info: VideoInfo,
    person: int = 0,
    notes: tuple[str, ...] = (),
) -> LandmarkTrack:
    """Return the rows of all frames as a track."""
    table = rows.reshape(-1, LANDMARKS, 7)
    lost = max(info.frames - len(table), 0)
    if lost:
        notes = (*notes, f"{lost} of {info.frames} frames are damaged and were left out")
    if info.step > 1:
        notes = (*notes, f"of {info.fps * info.step:.0f} frames a second {info.fps:.0f} are read")
    if info.uneven:
        notes = (*notes, f"the frame rate varies: the motion has {info.fps:.4g} a second")
    return LandmarkTrack(
        fps=info.fps,
        width=info.width,
        height=info.height,
        landmarks=table[..., 0:3],
        world_landmarks=table[..., 3:6],
        visibility=table[..., 6],
        time_s=time_s if uneven(time_s, info.fps) else None,
        person=person,
        notes=notes,
    )


@contextmanager
def video_landmarker(size: str) -> Iterator[Callable[[np.ndarray, float], np.ndarray]]:
    """Yield a detector that follows one person through the frames: call(image, seconds) -> (33, 7).

    Raises:
        MissingDependency: no model bundle, or no EGL and GLES libraries.
    """
    require_graphics()
    with _landmarker(model_path(size)) as landmarker:
        last_ms = -1

        def detect_frame(image: np.ndarray, time_s: float) -> np.ndarray:
            import mediapipe

            nonlocal last_ms
            is_first = last_ms < 0
            last_ms = max(round(time_s * 1000.0), last_ms + 1)  # MediaPipe's time must rise
            with _quiet_stderr(enabled=is_first):
                rows = np.ascontiguousarray(image)  # padded rows would be read askew, silently
                picture = mediapipe.Image(image_format=mediapipe.ImageFormat.SRGB, data=rows)
                result = landmarker.detect_for_video(picture, last_ms)
            row = first_person(result)
            return np.full((LANDMARKS, 7), np.nan) if row is None else row

        yield detect_frame


class _QuietAtFirst:
    """A landmarker that writes nothing to stderr for the first person it finds."""

    def __init__(self, landmarker: Any) -> None:
        self._landmarker, self._found = landmarker, False

    def detect(self, picture: Any) -> Any:
        """Return what the landmarker detects; its first warnings are not printed."""
        with _quiet_stderr(enabled=not self._found):
            result = self._landmarker.detect(picture)
        self._found = self._found or bool(result.pose_landmarks)
        return result


def require_graphics() -> None:
    """Raise `MissingDependency` where MediaPipe cannot be loaded."""
    missing = missing_graphics_libraries()
    if missing:
        raise MissingDependency(f"MediaPipe needs {' and '.join(missing)}: {GRAPHICS_INSTALL}")


@contextmanager
def still_landmarker(size: str) -> Iterator[Any]:
    """Yield an open PoseLandmarker for single pictures, without memory of earlier ones."""
    require_graphics()
    with _landmarker(model_path(size), still=True) as landmarker:
        yield _QuietAtFirst(landmarker)


@contextmanager
def _landmarker(model: Path, still: bool = False) -> Iterator[Any]:
    """Yield an open PoseLandmarker; MediaPipe is imported here because it takes seconds."""
    with _quiet_stderr():
        from mediapipe.tasks import python as tasks
        from mediapipe.tasks.python import vision

        options = vision.PoseLandmarkerOptions(
            base_options=tasks.BaseOptions(model_asset_path=str(model)),
            running_mode=vision.RunningMode.IMAGE if still else vision.RunningMode.VIDEO,
            num_poses=1,
        )
        landmarker = vision.PoseLandmarker.create_from_options(options)
    try:
        yield landmarker
    finally:
        with _quiet_stderr():
            landmarker.close()


@contextmanager
def _quiet_stderr(enabled: bool = True) -> Iterator[None]:
    """Send what the C++ side writes to file descriptor 2 to our debug log."""
    if not enabled:
        yield
        return
    sys.stderr.flush()
    saved = os.dup(2)
    with tempfile.TemporaryFile() as sink:
        os.dup2(sink.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            sink.seek(0)
            log.debug("MediaPipe: %s", sink.read().decode(errors="replace").strip())


def _loads(name: str) -> bool:
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


def first_person(result: Any) -> np.ndarray | None:
    """Return the first person of MediaPipe's answer as (33, 7), None for no person.

    Columns: image x, y, z; world x, y, z; visibility.
    """
    if not result.pose_landmarks:
        return None
    pairs = zip(result.pose_landmarks[0], result.pose_world_landmarks[0], strict=True)
    return np.array([[p.x, p.y, p.z, w.x, w.y, w.z, p.visibility] for p, w in pairs])
