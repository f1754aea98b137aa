"""Long clips: windows meet without a seam, and one pass looks at kinematics and contacts alike."""

import numpy as np
import pytest

from robojackson.retarget.solver.clip_problem import Problem, Weights
from robojackson.retarget.solver.collision import Detector
from robojackson.retarget.solver.initial_poses import frame_start, rest_start
from robojackson.retarget.solver.levenberg_marquardt import SolverConfig, solve
from robojackson.retarget.targets.keypoint_targets import Targets
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import pose, tree


def _sway(robot: Robot, steps: int) -> Targets:
    """Return the keypoints of a robot that sways slowly on the spot."""
    phase = 2 * np.pi * np.arange(steps)[:, None] * 0.015 * np.array([0.7, 1.1, 1.3] * 9)
    qpos = np.tile(robot.standing, (steps, 1))
    middle, spread = (robot.lower + robot.upper) / 2, (robot.upper - robot.lower) / 2
    qpos[:, 7:] = middle + 0.4 * spread * np.sin(phase[:, : len(middle)])
    return Targets(
        keypoints_w=pose(tree(robot), qpos).site_pos,
        weights=np.tile(robot.keypoint_weights, (steps, 1)),
        contact=np.zeros((steps, 2), int),
        heading=np.tile(np.eye(3), (steps, 1, 1)),
        dt=0.015,
        cycle_offset=None,
        airborne=np.ones(steps, bool),
    )


@pytest.mark.medium
def test_windows_of_a_long_clip_meet_as_smoothly_as_they_go_on(robot: Robot, monkeypatch):
    aims = _sway(robot, 240)
    problem = Problem.of(robot, aims, Weights())
    config = SolverConfig()
    whole = solve(problem, rest_start(problem), config, 30, 1e-4).qpos
    monkeypatch.setattr("robojackson.retarget.solver.levenberg_marquardt._WINDOW", 80)
    parts = solve(problem, rest_start(problem), config, 30, 1e-4).qpos
    assert np.degrees(np.quantile(np.abs(parts - whole)[:, 7:], 0.95)) < 3.0
    jerk = [np.abs(np.diff(qpos[:, 7:], 3, axis=0)).max() for qpos in (whole, parts)]
    assert jerk[1] < 3 * jerk[0]


@pytest.mark.medium
def test_the_memory_of_a_solution_does_not_grow_with_the_clip(robot: Robot, monkeypatch):
    seen = []
    monkeypatch.setattr(
        "robojackson.retarget.solver.levenberg_marquardt.Chain.step",
        lambda self, normal, free, damping: seen.append(self.frames) or np.zeros(free.shape),
    )
    problem = Problem.of(robot, _sway(robot, 1500), Weights())
    solve(problem, rest_start(problem), SolverConfig(), 1)
    assert max(seen) <= 480


def test_one_look_gives_the_kinematics_and_the_contacts(robot: Robot, poses: np.ndarray):
    shape, detector = tree(robot), Detector(robot, 0.002)
    posed, touches = detector.detect_posed(shape, poses)
    expected = pose(shape, poses)
    for name in ("body_pos", "body_rot", "anchor", "axis", "site_pos", "ball_pos"):
        np.testing.assert_allclose(getattr(posed, name), getattr(expected, name), atol=1e-9)
    np.testing.assert_array_equal(touches.frame, detector.touches(poses).frame)


def test_without_feet_only_the_floor_under_the_feet_is_left_out(robot: Robot, poses: np.ndarray):
    poses[:, 2] = 0.4
    with_feet = Detector(robot, 0.002).touches(poses)
    without = Detector(robot, 0.002, feet=False).touches(poses)
    under = with_feet.floor & np.isin(with_feet.bodies, robot.contact_bodies).any(axis=1)
    assert under.any()
    np.testing.assert_array_equal(np.sort(with_feet.distance[~under]), np.sort(without.distance))


def test_the_kinematic_floor_of_poses_that_the_robot_has_is_nothing(robot: Robot):
    problem = Problem.of(robot, _sway(robot, 60), Weights(posture=0.0))
    found = frame_start(problem, np.random.default_rng(0), 5)
    assert found.floor_mm < 5.0


@pytest.mark.parametrize("steps", [40, 161])
def test_a_start_has_a_pose_for_every_step(robot: Robot, steps: int):
    problem = Problem.of(robot, _sway(robot, steps), Weights())
    assert len(frame_start(problem, np.random.default_rng(0), 2).qpos) == steps
