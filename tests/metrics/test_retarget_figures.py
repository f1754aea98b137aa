"""Figures of a robot motion on motions whose figures are known."""

import numpy as np
import pytest

from robojackson.metrics import retarget_error

DT = 0.015
TIME = np.arange(40) * DT


def test_the_jerk_of_a_cubic_is_six_times_its_coefficient():
    points = np.zeros((40, 3, 3))
    points[..., 0] = 2.0 * TIME[:, None] ** 3
    assert retarget_error.jerk(points, DT) == pytest.approx(12.0)
    assert retarget_error.hinge_jerk_rms(points[..., 0], DT) == pytest.approx(12.0)


def test_a_bone_turned_by_a_right_angle_is_ninety_degrees_off():
    expected = np.array([[[0.0, 0, 0], [1.0, 0, 0]]])
    actual = np.array([[[5.0, 0, 0], [5.0, 2.0, 0]]])
    np.testing.assert_allclose(retarget_error.bone_angles_deg(actual, expected, [(0, 1)]), 90.0)


def test_keypoint_error_counts_weighted_points_only():
    actual, expected = np.zeros((2, 3, 3)), np.zeros((2, 3, 3))
    actual[:, 0, 2], actual[:, 1, 0] = 0.01, 9.0
    error = retarget_error.keypoint_error_mm(actual, expected, np.array([True, False, True]))
    np.testing.assert_allclose(error, [[10.0, 0.0]] * 2)


def test_limit_excess_is_how_far_outside():
    excess = retarget_error.limit_excess(
        np.array([[-2.0, 0.0, 3.0]]), np.full(3, -1.0), np.full(3, 1.0)
    )
    np.testing.assert_allclose(excess, [[1.0, 0.0, 2.0]])


def test_slip_is_scored_where_both_ends_of_a_step_are_planted():
    velocity = np.zeros((3, 1, 2))
    velocity[:, 0, 0] = [0.1, 0.2, 0.4]
    planted = np.array([[True], [True], [False], [True]])
    np.testing.assert_allclose(retarget_error.slip_cm_s(velocity, planted), [10.0])


def test_slip_of_a_cycle_counts_the_step_over_the_seam():
    velocity = np.full((4, 1, 2), [0.3, 0.4])
    planted = np.array([[True], [False], [False], [True]])
    np.testing.assert_allclose(retarget_error.slip_cm_s(velocity, planted), [50.0])


@pytest.mark.parametrize("roll", [0, 15, 30, 45])
def test_a_flight_across_the_seam_of_a_cycle_is_one_as_any_other(roll: int):
    """A body in the air for 14 steps of 60, wherever the cycle begins."""
    dt, step = 0.02, np.arange(60)
    height = 1.0 + np.where(step < 14, 4.0 * (step + 0.5) * (13.5 - step) * dt**2, 0.0)
    soles = np.where(step < 14, 0.2, 0.0)[:, None]
    found = retarget_error.unsupported(
        np.roll(soles, roll, 0), np.roll(height, roll), dt, ring=True
    )
    inside = retarget_error.unsupported(np.roll(soles, 20, 0), np.roll(height, 20), dt)
    np.testing.assert_array_equal(np.roll(found, 20 - roll), inside)


def test_a_levitating_body_is_unsupported_and_a_falling_one_is_not():
    soles = np.full((40, 2), 0.3)
    assert retarget_error.unsupported(soles, np.full(40, 1.0), DT).all()
    assert retarget_error.unsupported(soles, 3.0 - 4.905 * TIME**2, DT).mean() < 0.1
    assert not retarget_error.unsupported(soles * [0.0, 1.0], np.full(40, 1.0), DT).any()
