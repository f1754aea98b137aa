"""The path through the room of a person whom a moving camera films."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robojackson.clips.people.camera_path import CameraPath, camera_path
from robojackson.clips.video import read_frames
from robojackson.mocap.recover import MocapConfig, recover_motion
from robojackson.motion.landmark_track import LandmarkTrack

ROOT = Path(__file__).parents[3]


def panned(track: LandmarkTrack) -> tuple[LandmarkTrack, CameraPath]:
    """Return the bundled hip-shake through a window that sways over it, and the path that the
    background shows."""
    width, frames = 448, len(track)
    swing = 1.0 + np.sin(np.arange(frames) / frames * 4.0 * np.pi)
    offsets = np.round((track.width - width) / 2.0 * swing).astype(int)
    landmarks = np.array(track.landmarks)
    landmarks[..., 0] = (landmarks[..., 0] * track.width - offsets[:, None]) / width
    window = replace(track, width=width, landmarks=landmarks)
    frames_of = read_frames(ROOT / "clips" / "hip_shake.mp4")
    images = (image[:, x : x + width] for image, x in zip(frames_of, offsets, strict=True))
    return window, camera_path(images, landmarks[..., :2], width, track.height)


@pytest.mark.medium
def test_a_swaying_camera_moves_the_root_unless_its_background_is_known(
    hip_shake: LandmarkTrack,
) -> None:
    window, camera = panned(hip_shake)
    still = recover_motion(hip_shake, MocapConfig()).joints[:, 0, :2]
    result = recover_motion(replace(window, to_first=camera.to_first), MocapConfig()).joints[
        :, 0, :2
    ]
    blind = recover_motion(window, MocapConfig()).joints[:, 0, :2]
    assert np.linalg.norm(result - still, axis=-1).max() < 0.08
    assert np.linalg.norm(blind - still, axis=-1).max() > 0.25
