"""The recorded track of the bundled hip-shake."""

from pathlib import Path

import numpy as np
import pytest

from robojackson.motion.landmark_track import LandmarkTrack

GOLDEN = Path(__file__).parents[1] / "golden"


@pytest.fixture(scope="session")
def hip_shake() -> LandmarkTrack:
    """Return the landmarks that MediaPipe (full) found in clips/hip_shake.mp4: 120 frames."""
    with np.load(GOLDEN / "hip_shake_track.npz") as data:
        return LandmarkTrack(
            fps=float(data["fps"]),
            width=int(data["width"]),
            height=int(data["height"]),
            landmarks=data["landmarks"].astype(float),
            world_landmarks=data["world_landmarks"].astype(float),
            visibility=data["visibility"].astype(float),
        )
