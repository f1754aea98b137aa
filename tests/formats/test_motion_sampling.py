"""Frames at another rate are where the motion in closed form is."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.robot.sampling import sampled
from tests.formats.conftest import (
    DT,
    PERIOD_S,
    STEPS,
    TILT,
    hinge_rates,
    poses,
    same_rotations,
    yaw_rate,
)

RATES = (30, 50, 120)


@pytest.mark.parametrize("fps", RATES)
def test_a_motion_of_one_step_is_a_frame_that_stands(swaying: ReferenceMotion, fps: int) -> None:
    rows = {name: getattr(swaying, name)[:1] for name in ("qpos", "qvel", "keypoints_w", "contact")}
    found = sampled(replace(swaying, cyclic=False, **rows), fps)
    np.testing.assert_array_equal(found.qpos, swaying.qpos[:1])
    assert found.qvel is not None
    assert not found.qvel.any()


@pytest.mark.parametrize("fps", RATES)
@pytest.mark.parametrize("cyclic", [True, False])
def test_frames_lie_on_the_motion(swaying: ReferenceMotion, fps: int, cyclic: bool) -> None:
    found = sampled(replace(swaying, cyclic=cyclic), fps).qpos
    expected = poses(np.arange(len(found)) / fps)
    hinges = np.delete(found, range(3, 7), 1), np.delete(expected, range(3, 7), 1)
    np.testing.assert_allclose(*hinges, atol=2e-5)
    np.testing.assert_allclose(same_rotations(found[:, 3:7], expected[:, 3:7]), 1.0, atol=1e-9)


@pytest.mark.parametrize("fps", RATES)
def test_a_cycle_fills_its_period_and_no_more(swaying: ReferenceMotion, fps: int) -> None:
    assert len(sampled(swaying, fps)) == np.ceil(PERIOD_S * fps)


@pytest.mark.parametrize("fps", RATES)
def test_an_open_motion_ends_at_its_last_step(swaying: ReferenceMotion, fps: int) -> None:
    last_s = (len(sampled(replace(swaying, cyclic=False), fps)) - 1) / fps
    end_s = (STEPS - 1) * DT
    assert end_s - 1 / fps < last_s <= end_s + 1e-9


@pytest.mark.parametrize("cyclic", [True, False])
def test_hinge_velocities_are_the_derivative(swaying: ReferenceMotion, cyclic: bool) -> None:
    found = sampled(replace(swaying, cyclic=cyclic), 50).qvel
    expected = hinge_rates(np.arange(len(found)) / 50)
    np.testing.assert_allclose(found[:, 6:], expected, atol=0.01)


def test_the_roots_turn_is_reported_in_its_own_axes(swaying: ReferenceMotion) -> None:
    """A turn about the vertical, seen by a root that leans about its own x axis."""
    found = sampled(swaying, 50).qvel[:, 3:6]
    rate = yaw_rate(np.arange(len(found)) / 50)
    expected = rate[:, None] * [0.0, np.sin(TILT), np.cos(TILT)]
    np.testing.assert_allclose(found, expected, atol=0.005)


def test_without_a_rate_the_control_steps_stay(swaying: ReferenceMotion) -> None:
    found = sampled(swaying)
    assert found.fps == pytest.approx(1 / DT)
    np.testing.assert_array_equal(found.qpos, swaying.qpos)
