"""Laws of the motion metrics, on motions whose derivatives are known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.metrics import motion_quality

FPS = 50.0
TIME = np.arange(60) / FPS


def along_x(path: np.ndarray) -> np.ndarray:
    return np.stack([path, 0 * path, 0 * path], -1)[:, None]


def test_acceleration_of_a_parabola_is_twice_its_factor() -> None:
    assert motion_quality.acceleration(along_x(1.5 * TIME**2), FPS) == pytest.approx(3.0)


def test_jerk_of_a_cubic_is_six_times_its_factor() -> None:
    assert motion_quality.jerk(along_x(0.5 * TIME**3), FPS) == pytest.approx(3.0)


def test_figures_do_not_see_the_frame_of_axes() -> None:
    joints = np.random.default_rng(0).normal(size=(30, 5, 3))
    turned = joints @ Rotation.from_rotvec([1.0, -2.0, 0.5]).as_matrix().T + [3.0, 1.0, 0.0]
    assert motion_quality.jerk(turned, FPS) == pytest.approx(motion_quality.jerk(joints, FPS))
    assert motion_quality.acceleration(turned, FPS) == pytest.approx(
        motion_quality.acceleration(joints, FPS)
    )


def test_slide_is_the_horizontal_speed_of_standing_points() -> None:
    feet = np.zeros((60, 2, 3))
    feet[:, 0, 0], feet[:, 0, 2] = 0.4 * TIME, 0.5 * TIME
    feet[:, 1, 1] = 9.0 * TIME
    standing = np.tile([True, False], (60, 1))
    assert motion_quality.foot_slide(feet, standing, FPS) == pytest.approx(0.4)


def test_a_point_that_stands_in_single_frames_does_not_slide() -> None:
    standing = (np.arange(60) % 2 == 0)[:, None]
    assert (
        motion_quality.foot_slide(np.random.default_rng(1).normal(size=(60, 1, 3)), standing, FPS)
        == 0.0
    )


def test_penetration_is_the_greatest_depth_and_never_negative() -> None:
    feet = np.zeros((4, 4, 3))
    feet[2, 1, 2] = -0.03
    assert motion_quality.floor_penetration(feet) == pytest.approx(0.03)
    assert motion_quality.floor_penetration(feet + [0, 0, 1.0]) == 0.0


def test_unsupported_counts_frames_without_contact_outside_free_fall() -> None:
    contact = np.array([[1, 0], [0, 0], [0, 0], [0, 2]])
    falling = np.array([False, False, True, False])
    assert motion_quality.unsupported(contact, falling) == pytest.approx(1 / 3)


def test_short_clips_have_no_derivatives() -> None:
    assert motion_quality.jerk(np.zeros((3, 1, 3)), FPS) == 0.0
