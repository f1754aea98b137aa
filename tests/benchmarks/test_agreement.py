"""The figure of agreement with the official HybrIK."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.mocap.agreement import agreement
from robojackson.errors import BadTable
from robojackson.formats.foreign_motion import HybrikMotion

GENERATOR = np.random.default_rng(0)
POINTS = GENERATOR.normal(0.0, 0.4, (20, 29, 3))


def official(frame: np.ndarray) -> HybrikMotion:
    """Return a file of these frames."""
    points = POINTS[frame] - POINTS[frame][:, :1]
    twist = np.broadcast_to([1.0, 0.0], (len(frame), 23, 2))
    pixels, sure = np.zeros((len(frame), 29, 2)), np.ones((len(frame), 29))
    return HybrikMotion(points, pixels, twist, None, sure, frame, np.zeros(10), 640, 480)


def test_the_same_motion_in_another_world_agrees_fully() -> None:
    turn = Rotation.from_rotvec([0.3, -1.0, 2.0]).as_matrix()
    moved = POINTS[:, :24] @ turn.T + np.array([1.0, 2.0, 3.0])
    assert agreement(moved, official(np.arange(20)))["mpjpe_mm"] < 1e-6


def test_frames_that_hybrik_skipped_are_skipped() -> None:
    frame = np.array([0, 1, 2, 7, 8, 19])
    found = agreement(POINTS[:, :24], official(frame))
    assert found["mpjpe_mm"] < 1e-6
    assert found["frames"] == 6


def test_size_counts() -> None:
    spread = np.linalg.norm(POINTS[:, :24] - POINTS[:, :1], axis=-1).mean()
    found = agreement(1.1 * POINTS[:, :24], official(np.arange(20)))
    assert found["mpjpe_mm"] == pytest.approx(100.0 * spread)
    assert found["pa_mpjpe_mm"] < 1e-6


def test_the_output_of_another_video_is_refused() -> None:
    with pytest.raises(BadTable, match="frame 19, the video has 12 frames"):
        agreement(POINTS[:12, :24], official(np.arange(20)))
