"""Frames of a BVH that no body has made are left out or interpolated, real motion is not."""

import numpy as np

from robojackson.formats.containers.bvh_faults import JUMP_M_S, mended

FPS = 120.0


def motion() -> np.ndarray:
    """Return a second of three joints: one that stands, two that swing at up to 9 m/s."""
    time = np.arange(120) / FPS
    points = np.zeros((120, 3, 3))
    points[:, 0, 0] = time
    points[:, 1] = [0.1, 0.0, 0.5]
    points[:, 2, 2] = 0.7 * np.sin(4 * np.pi * time)
    return points


def test_a_motion_stays_as_it_is() -> None:
    points = motion()
    found, notes = mended(points, FPS)
    np.testing.assert_allclose(found, points, atol=1e-12)
    assert notes == ()


def test_a_rest_pose_before_the_motion_is_left_out() -> None:
    points = motion()
    found, notes = mended(np.concatenate([points[:1] + [[[0], [0.4], [-0.5]]], points]), FPS)
    np.testing.assert_allclose(found, points, atol=1e-12)
    assert "rest pose" in notes[0]


def test_a_fast_beginning_is_no_rest_pose() -> None:
    points = motion()
    points[:, 2, 0] = 2 * JUMP_M_S * np.arange(120) / FPS
    found, _ = mended(points, FPS)
    assert len(found) == len(points)


def test_joints_that_jump_away_and_back_are_interpolated() -> None:
    points = motion()
    spoilt = points.copy()
    spoilt[40:43, 2, 1] += 0.3
    spoilt[80, 1] += 0.25
    found, notes = mended(spoilt, FPS)
    np.testing.assert_allclose(found, points, atol=0.02)
    assert f"in 4 of {len(points)} frames" in notes[0]


def test_frames_between_two_spikes_stay() -> None:
    points = motion()
    spoilt = points.copy()
    for first in (30, 50):
        spoilt[first : first + 10, 1, 2] += 0.3
    found, notes = mended(spoilt, FPS)
    np.testing.assert_allclose(found[:, 1], points[:, 1], atol=1e-9)
    assert f"in 20 of {len(points)} frames" in notes[0]


def test_joints_that_stay_away_are_kept() -> None:
    points = motion()
    points[60:, 1, 1] += 0.4
    found, notes = mended(points, FPS)
    np.testing.assert_allclose(found, points, atol=1e-12)
    assert notes == ()
