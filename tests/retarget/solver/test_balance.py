"""The support of ball feet, and the lean that brings a standing body over it."""

import numpy as np
import pytest
from scipy.optimize import nnls

from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.retargeting import retarget_motion
from robojackson.retarget.solver.balance import moment_points, support
from robojackson.retarget.solver.clip_problem import Problem, Weights
from robojackson.retarget.targets.keypoint_targets import Targets
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import centre_of_mass, pose, tree
from tests.fixtures.robots import human, robot_motion

FEET = np.array([[[0.0, 0.2], [0.0, -0.2]]])
BOTH, LEFT = np.array([[True, True]]), np.array([[True, False]])


@pytest.mark.parametrize(
    ("point", "touching", "nearest"),
    [
        ([0.3, 0.05], BOTH, [0.0, 0.05]),
        ([0.0, 0.9], BOTH, [0.0, 0.2]),
        ([0.1, -0.1], LEFT, [0.0, 0.2]),
    ],
)
def test_the_nearest_support_is_on_the_line_between_the_feet(point, touching, nearest):
    found = support(np.array([point]), FEET, touching)
    np.testing.assert_allclose(found.nearest[0], nearest, atol=1e-12)
    shared = np.einsum("nc,nci->ni", found.weights, FEET)[0]
    np.testing.assert_allclose(shared, nearest, atol=1e-12)


def test_the_nearest_point_of_four_soles_is_that_of_their_convex_hull(rng):
    """Against a quadratic programme over the shares, solved by scipy."""
    feet = rng.normal(size=(20, 4, 2))
    points = 2 * rng.normal(size=(20, 2))
    found = support(points, feet, np.ones((20, 4), bool))
    for corners, point, nearest in zip(feet, points, found.nearest, strict=True):
        matrix = np.vstack([corners.T, 1e4 * np.ones(4)])
        shares, _ = nnls(matrix, np.append(point, 1e4))
        np.testing.assert_allclose(nearest, corners.T @ shares, atol=1e-5)


def test_a_body_in_the_air_has_no_support():
    found = support(np.zeros((1, 2)), FEET, np.array([[False, False]]))
    np.testing.assert_array_equal(found.weights, 0.0)


def _distance_mm(motion, robot: Robot) -> float:
    """Return the mean static distance of the centre of mass from the line between the feet."""
    posed = pose(tree(robot), motion.qpos)
    com, feet = centre_of_mass(tree(robot), posed)[:, :2], posed.site_pos[:, [5, 6], :2]
    along = feet[:, 1] - feet[:, 0]
    off = com - feet[:, 0]
    area = along[:, 0] * off[:, 1] - along[:, 1] * off[:, 0]
    return float(1e3 * np.mean(np.abs(area) / np.linalg.norm(along, axis=1)))


@pytest.mark.medium
def test_a_standing_dance_is_leaned_over_its_feet(robot: Robot):
    upright = retarget_motion(human("hip_shake"), robot, RetargetConfig(lean_deg=0.0))
    leaned = robot_motion("hip_shake")
    assert leaned.scorecard["lean_deg"] > 1.0
    assert _distance_mm(leaned, robot) < 20.0
    assert _distance_mm(leaned, robot) < 0.5 * _distance_mm(upright, robot)


def test_a_walk_keeps_its_posture():
    assert robot_motion("walk").scorecard["lean_deg"] == 0.0


def test_the_moment_point_of_a_still_body_is_its_centre_of_mass(robot: Robot):
    still = np.tile(robot.standing, (20, 1))
    posed = pose(tree(robot), still)
    aims = Targets(
        keypoints_w=posed.site_pos,
        weights=np.ones((20, 14)),
        contact=np.ones((20, 2), int),
        heading=np.tile(np.eye(3), (20, 1, 1)),
        dt=0.015,
        cycle_offset=None,
        airborne=np.zeros(20, bool),
    )
    points = moment_points(Problem.of(robot, aims, Weights()), posed)
    np.testing.assert_allclose(points, centre_of_mass(tree(robot), posed)[:, :2], atol=1e-9)
