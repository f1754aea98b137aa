"""The gradient of each term is the slope of its cost."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.motion.smpl_sequence import PLANTED
from robojackson.retarget.solver.clip_problem import Problem, Weights
from robojackson.retarget.solver.cost_terms import linearise
from robojackson.retarget.targets.keypoint_targets import Targets
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import integrate, pose, tree

TERMS = ["height", "penetration", "self_penetration", "slip", "balance", "acceleration"]
TERMS += ["posture", "speed"]
OFF = dict.fromkeys(TERMS, 0.0)
FRAMES = 12


def _problem(
    robot: Robot, cycle_offset: np.ndarray | None, **weights: float
) -> tuple[Problem, np.ndarray]:
    """Return a sway near the floor that moves every joint, and targets a little off it."""
    rng = np.random.default_rng(3)
    phase = 2 * np.pi * np.arange(FRAMES)[:, None] / FRAMES
    sway = 0.05 * np.sin(phase + rng.uniform(0, 6, robot.model.nv))
    qpos = np.tile(robot.standing, (FRAMES, 1))
    qpos[:, 2] -= 0.11
    qpos = integrate(qpos, sway)
    sites = pose(tree(robot), qpos).site_pos
    aims = Targets(
        keypoints_w=sites + 0.02 * rng.normal(size=sites.shape),
        weights=np.tile(robot.keypoint_weights * weights.pop("keypoint", 0.0), (FRAMES, 1)),
        contact=np.full((FRAMES, 2), PLANTED),
        heading=np.tile(np.eye(3), (FRAMES, 1, 1)),
        dt=0.03,
        cycle_offset=cycle_offset,
        airborne=np.zeros(FRAMES, bool),
    )
    return Problem.of(robot, aims, Weights(**{**OFF, **weights})), qpos


def _slope(problem: Problem, qpos: np.ndarray, direction: np.ndarray) -> float:
    step = 1e-5
    ahead = linearise(problem, integrate(qpos, step * direction)).cost
    behind = linearise(problem, integrate(qpos, -step * direction)).cost
    return (ahead - behind) / (2 * step)


@pytest.mark.parametrize("cycle_offset", [None, np.zeros(3), np.array([0.3, 0.1, 0.0])])
@pytest.mark.parametrize(
    ("term", "weight", "tolerance"),
    [
        ("keypoint", 1.0, 1e-5),
        ("height", 100.0, 1e-5),
        ("slip", 4.0, 2e-2),
        ("posture", 1.0, 1e-5),
        ("acceleration", 1e-3, 2e-2),
    ],
)
def test_the_gradient_is_the_slope_of_the_cost(robot, cycle_offset, term, weight, tolerance, rng):
    problem, qpos = _problem(robot, cycle_offset, **{term: weight})
    gradient = linearise(problem, qpos).gradient
    direction = rng.normal(size=gradient.shape)
    expected = _slope(problem, qpos, direction)
    scale = np.linalg.norm(gradient) * np.linalg.norm(direction)
    assert abs(expected) > 1e-9
    assert np.sum(gradient * direction) == pytest.approx(expected, abs=tolerance * scale)


def test_the_balance_gradient_points_downhill(robot, rng):
    problem, qpos = _problem(robot, np.zeros(3), balance=1.0)
    normal = linearise(problem, qpos)
    assert _slope(problem, qpos, -normal.gradient) < 0.0


def test_a_rolling_ball_does_not_slip(robot):
    """A shin that tips about the ground moves its ball's centre by radius times angle."""
    problem, _ = _problem(robot, None, slip=1.0)
    rolled = np.repeat(robot.standing[None], FRAMES, axis=0)
    radius, angle = robot.contact_radii[0], 0.02 * np.arange(FRAMES)
    rolled[:, 3], rolled[:, 5] = np.cos(angle / 2), np.sin(angle / 2)
    site = pose(problem.tree, rolled).site_pos[:, robot.contact_keypoints[0]]
    rolled[:, :3] += np.stack([radius * angle, 0 * angle, 0 * angle + radius], 1) - site
    free = replace(problem, targets=replace(problem.targets, contact=np.array([[0, 1]] * FRAMES)))
    assert linearise(free, rolled).cost < 1e-6
    slid = rolled.copy()
    slid[:, 0] += 0.01 * np.arange(FRAMES)
    assert linearise(free, slid).cost > 0.1
