"""Resampling goes through its samples, and a cycle continues over its seam."""

import mujoco
import numpy as np
import pytest

from robojackson.robot.model import Robot
from robojackson.robot.resampling import resample, seam_angle, velocities
from robojackson.robot.tree_kinematics import integrate

COUNT = 40


def _turning(robot: Robot, turns: int) -> np.ndarray:
    """Return a cycle in which the root turns about z, the hinges swing, and the root travels along
    x."""
    phase = 2 * np.pi * np.arange(COUNT) / COUNT
    qpos = np.tile(robot.standing, (COUNT, 1))
    qpos[:, 0] += 0.4 * np.arange(COUNT) / COUNT
    qpos[:, 3], qpos[:, 6] = np.cos(turns * phase / 2), np.sin(turns * phase / 2)
    qpos[:, 7:] += 0.3 * np.sin(phase)[:, None]
    return qpos


CYCLE_OFFSET = np.array([0.4, 0.0, 0.0])


@pytest.mark.parametrize("cycle_offset", [None, CYCLE_OFFSET])
@pytest.mark.parametrize("turns", [0, 1])
def test_the_samples_come_back(robot: Robot, cycle_offset, turns):
    qpos = _turning(robot, turns)
    np.testing.assert_allclose(resample(qpos, np.arange(COUNT), cycle_offset), qpos, atol=1e-9)


@pytest.mark.parametrize("turns", [0, 1])
def test_a_cycle_continues_with_its_first_step_moved(robot: Robot, turns):
    qpos = _turning(robot, turns)
    halves = resample(qpos, np.arange(2 * COUNT) / 2, CYCLE_OFFSET)
    assert seam_angle(halves, 0.015, CYCLE_OFFSET) < 0.05
    exact = np.sin(2 * np.pi * (COUNT - 0.5) / COUNT) * 0.3 + qpos[0, 7]
    assert halves[-1, 7] == pytest.approx(exact, abs=1e-4)


def test_quaternions_stay_unit(robot: Robot):
    quat = resample(_turning(robot, 1), np.linspace(0, COUNT - 1, 333), None)[:, 3:7]
    np.testing.assert_allclose(np.linalg.norm(quat, axis=1), 1.0, atol=1e-12)


def test_velocities_are_mujocos_central_differences(robot: Robot):
    qpos, dt = _turning(robot, 1), 0.015
    ours = velocities(qpos, dt, None)
    halves = np.zeros((2, robot.model.nv))
    for t in range(1, COUNT - 1):
        mujoco.mj_differentiatePos(robot.model, halves[0], dt, qpos[t - 1], qpos[t])
        mujoco.mj_differentiatePos(robot.model, halves[1], dt, qpos[t], qpos[t + 1])
        np.testing.assert_allclose(ours[t], halves.mean(axis=0), atol=1e-9)


def test_a_broken_seam_is_measured(robot: Robot, rng: np.random.Generator):
    qpos = _turning(robot, 0)
    broken = integrate(qpos, 0.0 * rng.normal(size=(COUNT, robot.model.nv)))
    broken[0, 9] += np.radians(20.0)
    assert seam_angle(broken, 0.015, CYCLE_OFFSET) > 15.0
