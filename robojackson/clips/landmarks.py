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

from robojackson.clips.track import LANDMARKS, LandmarkTrack
from robojackson.clips.video import VideoInfo, read_frames
from robojackson.errors import MissingDependency, UnknownName

Size = Literal["lite", "full", "heavy"]
Watcher = Callable[[int, np.ndarray, np.ndarray], None]
"""Called with the number of a frame, its RGB image and its row (33, 7): image xyz, world xyz,
visibility; NaN when nobody was found."""
SIZES: tuple[str, ...] = ("lite", "full", "heavy")
ASSETS = Path(__file__).parent.parent / "assets"
GRAPHICS_LIBRARIES = ("libEGL.so.1", "libGLESv2.so.2")
GRAPHICS_INSTALL = (
    "apt-get install --no-install-recommends libegl1 libgles2 libopengl0 libgl1-mesa-dri"
)

log = logging.getLogger(__name__)


def model_path(size: str) -> Path:
    """The bundle of one size.

    Raises:
        UnknownName: no such size.
        MissingDependency: the bundle is not here; the message is the command that brings it.
    """
    if size not in SIZES:
        raise UnknownName("pose model", size, "clips.landmarks", SIZES)
    path = ASSETS / f"pose_landmarker_{size}.task"
    if not path.is_file():
        raise MissingDependency(
            f"{path.name} is not installed; "
            f"build it: python -m tools.build_pose_models --size {size}"
        )
    return path


def missing_graphics_libraries() -> tuple[str, ...]:
    """The shared libraries that MediaPipe links to and this machine lacks."""
    return tuple(name for name in GRAPHICS_LIBRARIES if not _loads(name))


def detect(
    path: Path,
    info: VideoInfo,
    size: str = "full",
    progress: Callable[[int, int], None] | None = None,
    watch: Watcher | None = None,
) -> LandmarkTrack:
    """Landmarks of the most prominent person, NaN rows where nobody is found.

    Args:
        path: Video file.
        info: What `probe` found in it.
        size: lite, full or heavy.
        progress: Called with (frames done, frames in all) after every frame.
        watch: Sees every frame too, so that a clip is decoded once.
    Raises:
        MissingDependency: no model bundle, or no EGL and GLES libraries.
    """
    missing = missing_graphics_libraries()
    if missing:
        raise MissingDependency(f"MediaPipe needs {' and '.join(missing)}: {GRAPHICS_INSTALL}")
    with _landmarker(model_path(size)) as landmarker:
        rows = []
        for index, image in enumerate(read_frames(path)):
            rows.append(_detect_one(landmarker, image, round(index * 1000.0 / info.fps), index))
            if watch:
                watch(index, image, rows[-1])
            if progress:
                progress(index + 1, info.frames)
    table = np.array(rows).reshape(-1, LANDMARKS, 7)
    return LandmarkTrack(
        fps=info.fps,
        width=info.width,
        height=info.height,
        landmarks=table[..., 0:3],
        world_landmarks=table[..., 3:6],
        visibility=table[..., 6],
    )


@contextmanager
def still_landmarker(size: str) -> Iterator[Any]:
    """An open PoseLandmarker for single pictures, which remembers nothing of the one before."""
    with _landmarker(model_path(size), still=True) as landmarker:
        yield landmarker


def _detect_one(landmarker: Any, image: np.ndarray, time_ms: int, index: int) -> np.ndarray:
    """One row (33, 7): image xyz, world xyz, visibility; NaN when nobody is found."""
    import mediapipe

    with _quiet_stderr(enabled=index == 0):
        rows = np.ascontiguousarray(image)  # padded rows would be read askew, without an error
        picture = mediapipe.Image(image_format=mediapipe.ImageFormat.SRGB, data=rows)
        result = landmarker.detect_for_video(picture, time_ms)
    if not result.pose_landmarks:
        return np.full((LANDMARKS, 7), np.nan)
    pairs = zip(result.pose_landmarks[0], result.pose_world_landmarks[0], strict=True)
    return np.array([[p.x, p.y, p.z, w.x, w.y, w.z, p.visibility] for p, w in pairs])


@contextmanager
def _landmarker(model: Path, still: bool = False) -> Iterator[Any]:
    """An open PoseLandmarker; MediaPipe is imported here because it takes seconds."""
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
