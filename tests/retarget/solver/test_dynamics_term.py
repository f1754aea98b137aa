"""The dynamics term has the gradient it claims, and repair makes motions feasible."""

import copy
from dataclasses import replace

import numpy as np
import pytest

from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.retargeting import retarget_motion
from robojackson.retarget.solver import dynamics_term
from robojackson.retarget.solver.block_banded import Normal
from robojackson.retarget.solver.clip_problem import Problem, Warm
from robojackson.retarget.solver.levenberg_marquardt import solve
from robojackson.retarget.targets.cycle import human_clip
from robojackson.retarget.targets.keypoint_targets import select_steps, targets
from robojackson.retarget.whole_clip import faults
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import integrate, pose
from tests.fixtures.robots import human, robot_motion

UNREPAIRED = replace(RetargetConfig().repair, weights=())


def _problem(robot: Robot) -> Problem:
    clip, _ = human_clip(human("walk"), 0.015, "auto", 1.0, RetargetConfig().cycle)
    weights = replace(RetargetConfig().weights, dynamics=0.1)
    return Problem.of(robot, targets(clip, robot), weights)


def _gliding(problem: Problem) -> np.ndarray:
    """Return one pose that travels as far as the cycle does."""
    count, cycle_offset = len(problem.targets), problem.targets.cycle_offset
    assert cycle_offset is not None
    qpos = np.repeat(robot_motion("walk").qpos[:1], count, 0)
    qpos[:, :3] += np.arange(count)[:, None] * cycle_offset / count
    return qpos


def _term(problem: Problem, qpos: np.ndarray) -> Normal:
    out = Normal.empty(len(qpos), qpos.shape[1] - 1)
    dynamics_term.add_dynamics(problem, qpos, pose(problem.tree, qpos), out)
    return out


def test_the_terms_gradient_is_that_of_its_cost(robot: Robot, rng: np.random.Generator):
    problem, qpos = _problem(robot), robot_motion("walk").qpos
    here = _term(problem, qpos)
    for _ in range(3):
        way = rng.normal(size=here.gradient.shape)
        ahead, back = (_term(problem, integrate(qpos, s * 1e-7 * way)).cost for s in (1, -1))
        slope = float(np.sum(here.gradient * way))
        usual = np.linalg.norm(here.gradient)  # of the slope along a random way
        assert (ahead - back) / 2e-7 == pytest.approx(slope, abs=0.05 * usual)


@pytest.mark.parametrize("steps", [1, 7])
def test_the_term_is_the_same_to_the_last_bit_in_parts_of_any_length(
    robot: Robot, steps: int, monkeypatch: pytest.MonkeyPatch
):
    problem, qpos = _problem(robot), robot_motion("walk").qpos[:30]
    aims = replace(select_steps(problem.targets, slice(0, 30)), cycle_offset=None)
    problem = replace(problem, targets=aims, warm=Warm())
    monkeypatch.setattr(dynamics_term, "_CHUNK", 1000)
    whole = _term(problem, qpos)
    monkeypatch.setattr(dynamics_term, "_CHUNK", steps)
    parts = _term(replace(problem, warm=Warm()), qpos)
    assert parts.cost == whole.cost
    np.testing.assert_array_equal(parts.gradient, whole.gradient)
    np.testing.assert_array_equal(parts.blocks, whole.blocks)


def test_the_slopes_of_inverse_dynamics_are_its_differences(robot: Robot):
    problem, qpos = _problem(robot), robot_motion("walk").qpos[:4]
    zero = np.zeros((4, robot.model.nv))
    from robojackson.retarget.feasibility.force_model import unconstrained
    from robojackson.retarget.feasibility.inverse_dynamics import inverse

    model = unconstrained(problem.robot)
    slopes = dynamics_term.inverse_slopes(model, qpos, zero, zero)
    nudge = zero.copy()
    nudge[:, 12] = 1e-6
    rise = (inverse(model, integrate(qpos, nudge), zero, zero) - slopes.force) / 1e-6
    np.testing.assert_allclose(slopes.position[:, :, 12], rise, atol=1e-3)


def test_a_model_with_dry_friction_is_differentiated_by_mujoco(robot: Robot):
    model = copy.copy(robot.model)
    model.dof_frictionloss[9] = 1.0
    assert dynamics_term.rigid(robot)
    assert not dynamics_term.rigid(replace(robot, model=model))


def test_steps_outside_the_spans_stay_as_they_are(robot: Robot):
    problem = _problem(robot)
    aims = replace(problem.targets, cycle_offset=None)
    problem, qpos = replace(problem, targets=aims), robot_motion("walk").qpos
    config = replace(RetargetConfig().solver, damping=1e-5)
    found = solve(problem, qpos, config, 3, spans=[slice(30, 60)]).qpos
    outside = np.r_[0:30, 60 : len(qpos)]
    np.testing.assert_allclose(found[outside], qpos[outside], atol=1e-12)
    assert np.abs(found[30:60] - qpos[30:60]).max() > 1e-4


@pytest.mark.medium
def test_repair_makes_a_walk_feasible_that_was_not(robot: Robot):
    config = RetargetConfig(repair=UNREPAIRED, slower_tempos=())
    before, after = retarget_motion(human("walk"), robot, config), robot_motion("walk")
    assert before.scorecard["infeasible_share"] > 0.1
    assert after.scorecard["infeasible_share"] <= 0.05
    assert after.scorecard["keypoint_mm"] <= before.scorecard["keypoint_mm"] + 5.0


@pytest.mark.medium
def test_a_motion_that_is_feasible_is_left_alone(robot: Robot):
    config = RetargetConfig(repair=UNREPAIRED, slower_tempos=())
    np.testing.assert_array_equal(
        retarget_motion(human("hip_shake"), robot, config).qpos, robot_motion("hip_shake").qpos
    )


@pytest.mark.slow
def test_a_dance_whose_legs_cross_is_repaired_and_slowed_down(robot: Robot):
    """Its cheapest solution has one shin jump through the other and back, in 15 ms each."""
    motion = robot_motion("dance_b")
    done = motion.scorecard
    assert done["passed"]
    assert done["infeasible_share"] <= 0.1
    assert 0.6 <= done["tempo_mean"] < 1.0
    assert done["self_penetration_mm"] <= 5.0
    assert done["speed_over_limit"] <= 0.9
    assert np.abs(np.diff(motion.keypoints_w, axis=0)).max() / motion.dt < 6.0


@pytest.mark.parametrize("step", [20, 0, -1])
def test_a_limb_that_jumps_is_a_fault_that_heavier_weights_do_not_mend(robot: Robot, step: int):
    problem, config = _problem(robot), RetargetConfig()
    calm = _gliding(problem)
    jumping = calm.copy()
    jumping[step, 9] += np.radians(20)
    assert not faults(problem, calm, config).jumps
    found = faults(problem, jumping, config)
    assert found.jumps
    assert found.any
    fast = replace(config, jump_bar_m_s2=10 * found.acceleration_m_s2)
    assert not faults(problem, jumping, fast).jumps


def test_a_limb_that_comes_out_elsewhere_after_a_cycle_has_jumped(robot: Robot):
    problem = _problem(robot)
    drifting = _gliding(problem)
    drifting[:, 9] += np.linspace(0.0, np.radians(60), len(drifting))
    assert faults(problem, drifting, RetargetConfig()).jumps
    open_ended = replace(problem, targets=replace(problem.targets, cycle_offset=None))
    assert not faults(open_ended, drifting, RetargetConfig()).jumps
