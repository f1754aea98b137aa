"""The sway that brings the zero moment point of a motion over the feet that carry it."""

import numpy as np
import pytest
from pydantic import ValidationError

from robojackson.motion.smpl_sequence import AIR, PLANTED
from robojackson.retarget import feasible_motion
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.retargeting import retarget_motion
from robojackson.retarget.solver.clip_problem import Problem, Weights
from robojackson.retarget.solver.sway import SwayConfig, swayed, zero_moment_points
from robojackson.retarget.targets.keypoint_targets import Targets
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import centre_of_mass, pose, tree
from tests.fixtures.robots import human, robot_motion

DT, STEPS = 0.02, 120
LEFT = np.array([PLANTED, AIR])


def _problem(
    robot: Robot, qpos: np.ndarray, contact: np.ndarray, cycle_offset: np.ndarray | None = None
) -> Problem:
    posed = pose(tree(robot), qpos)
    aims = Targets(
        keypoints_w=posed.site_pos,
        weights=np.ones(posed.site_pos.shape[:2]),
        contact=np.broadcast_to(contact, (len(qpos), 2)),
        heading=np.tile(np.eye(3), (len(qpos), 1, 1)),
        dt=DT,
        cycle_offset=cycle_offset,
        airborne=np.zeros(len(qpos), bool),
    )
    return Problem.of(robot, aims, Weights())


@pytest.fixture
def still(robot: Robot) -> np.ndarray:
    """The robot's stand, unmoved."""
    return np.tile(robot.standing, (STEPS, 1))


def test_a_still_body_is_carried_under_its_centre_of_mass(robot: Robot, still: np.ndarray) -> None:
    points, vertical = zero_moment_points(robot, still, DT)
    centre = centre_of_mass(tree(robot), pose(tree(robot), still))
    np.testing.assert_allclose(points, centre[:, :2], atol=1e-6)
    np.testing.assert_allclose(vertical, robot.model.body_mass.sum() * 9.81, rtol=1e-6)


def test_a_body_that_is_moved_is_carried_where_the_pendulum_says(
    robot: Robot, still: np.ndarray
) -> None:
    """A stiff body moved by s has its point at s - (h / g) s''."""
    time = np.arange(STEPS) * DT
    shift, pull = 0.03 * np.sin(4.0 * time), -0.48 * np.sin(4.0 * time)
    moved = still.copy()
    moved[:, 1] += shift
    height = centre_of_mass(tree(robot), pose(tree(robot), still))[0, 2]
    change = zero_moment_points(robot, moved, DT)[0] - zero_moment_points(robot, still, DT)[0]
    inner = slice(2, -2)
    np.testing.assert_allclose(change[inner, 0], 0.0, atol=1e-6)
    expected = shift - height / 9.81 * pull
    np.testing.assert_allclose(change[inner, 1], expected[inner], atol=5e-4)


def test_a_body_between_its_feet_goes_over_the_one_that_stands(
    robot: Robot, still: np.ndarray
) -> None:
    posed = pose(tree(robot), still)
    foot, centre = posed.ball_pos[0, 0, :2], centre_of_mass(tree(robot), posed)[0]
    way = foot - centre[:2]
    assert np.linalg.norm(way) > 0.05
    problem, config = _problem(robot, still, LEFT), SwayConfig()
    aims, sway = swayed(problem, still, config)
    left = np.linalg.norm(way - sway[STEPS // 2])
    assert left < 0.6 * np.linalg.norm(way)
    assert np.ptp(sway[30:-30], axis=0).max() < 0.02
    moved = aims.keypoints_w[..., :2] - problem.targets.keypoints_w[..., :2]
    share = problem.targets.keypoints_w[..., 2:] / centre[2]
    np.testing.assert_allclose(moved, share * sway[:, None], atol=1e-9)
    np.testing.assert_array_equal(aims.keypoints_w[..., 2], problem.targets.keypoints_w[..., 2])


def test_a_body_over_its_feet_stays(robot: Robot, still: np.ndarray) -> None:
    """The centre of mass is 26 mm in front of the ball feet."""
    both = _problem(robot, still, np.array([PLANTED, PLANTED]))
    _, sway = swayed(both, still, SwayConfig(margin_m=0.03))
    assert np.abs(sway).max() < 1e-9
    _, sway = swayed(both, still, SwayConfig(margin_m=0.0))
    assert sway[20:-20, 0].max() < -0.01
    np.testing.assert_allclose(sway[:, 1], 0.0, atol=1e-6)


def test_a_flight_is_left_alone(robot: Robot, still: np.ndarray) -> None:
    _, sway = swayed(_problem(robot, still, np.array([AIR, AIR])), still, SwayConfig())
    np.testing.assert_allclose(sway, 0.0, atol=1e-12)


@pytest.mark.medium
def test_a_cycle_has_no_seam(robot: Robot) -> None:
    """A cycle that begins elsewhere sways alike."""
    motion, turn = robot_motion("walk"), 17
    offset = np.asarray(motion.cycle_offset)
    later = np.roll(motion.qpos, -turn, axis=0)
    later[-turn:, :3] += offset

    def sway_of(qpos: np.ndarray, contact: np.ndarray) -> np.ndarray:
        return swayed(_problem(robot, qpos, contact, offset), qpos, SwayConfig())[1]

    first = sway_of(motion.qpos, motion.contact)
    second = sway_of(later, np.roll(motion.contact, -turn, axis=0))
    assert np.abs(first).max() > 1e-3
    np.testing.assert_allclose(second, np.roll(first, -turn, axis=0), atol=1e-6)


@pytest.mark.medium
def test_a_dance_keeps_its_tempo_by_swaying(robot: Robot) -> None:
    """Without the sway, dance_b must be slowed down or is refused."""
    card = retarget_motion(human("dance_b"), robot, RetargetConfig(tempo=1.0)).scorecard
    stiff = RetargetConfig(tempo=1.0, sway=SwayConfig(passes=0))
    before = retarget_motion(human("dance_b"), robot, stiff).scorecard
    assert before["sway_cm"] == 0.0 < card["sway_cm"]
    assert card["infeasible_share"] < before["infeasible_share"]
    assert card["passed"]


@pytest.mark.parametrize(
    ("share", "first", "last", "kept"), [(0.93, 0.9, 0.99, "given"), (0.8, 0.7, 0.75, "given"),
                                         (0.8, 0.7, 0.85, "last"), (0.93, 0.94, 0.97, "last")],
)  # fmt: skip
def test_a_repair_that_makes_less_feasible_is_not_taken(
    robot: Robot,
    still: np.ndarray,
    monkeypatch: pytest.MonkeyPatch,
    share: float,
    first: float,
    last: float,
    kept: str,
) -> None:
    """What the gate lets through is not repaired further where the first repair makes it worse."""
    aims = _problem(robot, still, LEFT).targets
    motions = {name: feasible_motion.given(still + shift, aims)
               for name, shift in (("first", 0.01), ("last", 0.02))}  # fmt: skip
    shares = {0.0: share, 0.01: first, 0.02: last}

    def share_of(robot: Robot, motion: feasible_motion.Feasible, config: object) -> float:
        return shares[round(float(motion.qpos[0, 0] - still[0, 0]), 3)]

    monkeypatch.setattr(feasible_motion, "feasible_share", share_of)
    monkeypatch.setattr(feasible_motion, "_solved", lambda *_: motions["first"])
    monkeypatch.setattr(feasible_motion, "_accepted", lambda *_: motions["first"])
    monkeypatch.setattr(feasible_motion, "_best_repair", lambda *_: motions["last"])
    before = feasible_motion.given(still, aims)
    found = feasible_motion.make_feasible(robot, before, RetargetConfig())
    expected = {"given": still, "last": still + 0.02}[kept]
    np.testing.assert_array_equal(found.qpos, expected)


def test_what_is_feasible_does_not_sway() -> None:
    card = robot_motion("hip_shake").scorecard
    assert card["infeasible_share"] < 0.05
    assert card["sway_cm"] == 0.0


@pytest.mark.parametrize("name", ["spread_m", "correlation_s", "point_sd_m", "reach_m"])
@pytest.mark.parametrize("value", [0.0, 1e-200, 1e200, np.nan])
def test_a_setting_beyond_all_measure_is_refused_by_name(name: str, value: float) -> None:
    with pytest.raises(ValidationError, match=name):
        SwayConfig(**{name: value})
