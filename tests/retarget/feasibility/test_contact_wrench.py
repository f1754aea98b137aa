"""Pushes and torques are the best there are; their smooth version has the derivatives it claims."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from robojackson.retarget.feasibility import contact_wrench, inverse_dynamics
from robojackson.retarget.feasibility.contact_wrench import Demand, Tolerance
from robojackson.retarget.feasibility.force_model import unconstrained
from robojackson.retarget.feasibility.interior_point import solve_box
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import integrate, pose, tree
from tests.fixtures.robots import robot_motion

BARRIER = 0.05


def _demand(robot: Robot, hurry: float = 1.0) -> Demand:
    """Return the demand of some steps of the walk, played `hurry` times as fast: too fast for some
    motors."""
    motion = robot_motion("walk")
    force = inverse_dynamics.free_space(robot, motion.qpos, motion.dt, motion.cycle_offset).at(
        hurry
    )
    near = inverse_dynamics.touching(robot, pose(tree(robot), motion.qpos))
    return inverse_dynamics.demand(robot, motion.qpos, force, near, Tolerance())


def _scipy_slack(demand: Demand, step: int) -> float:
    """Solve the same least squares by scipy's bounded solver, torques as unknowns; return the
    slack."""
    use = demand.usable[step]
    edges, hinges = int(use.sum()), len(demand.ease)
    matrix = np.zeros((6 + hinges, edges + hinges))
    matrix[:, :edges] = demand.scale[:, None] * demand.columns[step][:, use]
    matrix[6:, edges:] = np.diag(demand.scale[6:])
    lower = np.concatenate([np.zeros(edges), demand.lower[step]])
    upper = np.concatenate([np.full(edges, np.inf), demand.upper[step]])
    target = demand.scale * demand.force[step]
    found = lsq_linear(matrix, target, bounds=(lower, upper), tol=1e-13, max_iter=500)
    return float(np.linalg.norm(found.fun))


@pytest.mark.medium
@pytest.mark.parametrize("hurry", [1.0, 2.0])
def test_no_bounded_solver_leaves_less(hurry: float, robot: Robot):
    demand = _demand(robot, hurry)
    slack = contact_wrench.supply(demand).slack
    for step in range(0, len(slack), 9):
        assert slack[step] <= _scipy_slack(demand, step) + 1e-4


def test_pushes_pull_nothing_and_use_no_sole_in_the_air(robot: Robot):
    demand = _demand(robot)
    pushes = contact_wrench.supply(demand).pushes
    assert pushes.min() >= 0.0
    np.testing.assert_array_equal(pushes[~demand.usable], 0.0)


def test_a_sharper_barrier_comes_near_to_the_least(robot: Robot):
    demand = _demand(robot, 2.0)
    least = 0.5 * contact_wrench.supply(demand).slack ** 2
    soft, sharp = (
        np.abs(contact_wrench.relaxed(demand, mu).value - least).max() for mu in (1e-2, 1e-4)
    )
    assert sharp < 0.1 * soft


def test_slope_is_the_derivative_of_the_value(robot: Robot, rng: np.random.Generator):
    demand = _demand(robot)
    way = rng.normal(size=demand.force.shape) / demand.scale
    ahead, back = (
        contact_wrench.relaxed(replace(demand, force=demand.force + s * 1e-4 * way), BARRIER).value
        for s in (1, -1)
    )
    slope = np.sum(contact_wrench.relaxed(demand, BARRIER).slope * way, axis=1)
    np.testing.assert_allclose((ahead - back) / 2e-4, slope, rtol=1e-4, atol=1e-4)


def test_the_roots_square_is_the_second_derivative(robot: Robot, rng: np.random.Generator):
    demand = _demand(robot)
    way = rng.normal(size=demand.force.shape) / demand.scale
    ahead, back = (
        contact_wrench.relaxed(replace(demand, force=demand.force + s * 1e-4 * way), BARRIER).slope
        for s in (1, -1)
    )
    unit = np.broadcast_to(np.eye(len(demand.scale)), (len(demand.force), *[len(demand.scale)] * 2))
    root = contact_wrench.relaxed(demand, BARRIER).root() @ unit
    bend = (root.swapaxes(1, 2) @ (root @ way[..., None]))[..., 0]
    np.testing.assert_allclose((ahead - back) / 2e-4 / demand.scale, bend / demand.scale, atol=2e-3)


def test_a_start_nearby_leads_to_the_same_place(robot: Robot, rng: np.random.Generator):
    demand = _demand(robot)
    start = contact_wrench.relaxed(demand, BARRIER).point
    there = replace(demand, force=demand.force + 0.3 * rng.normal(size=demand.force.shape))
    cold = contact_wrench.relaxed(there, BARRIER)
    warm = contact_wrench.relaxed(there, BARRIER, start)
    np.testing.assert_allclose(warm.value, cold.value, atol=1e-6)
    np.testing.assert_allclose(warm.pushes, cold.pushes, atol=1e-4)


@pytest.mark.parametrize("barrier", [0.0, BARRIER])
def test_a_step_is_solved_the_same_alone_and_beside_others(robot: Robot, barrier: float):
    """Steps arrive after different numbers of iterations, and leave the others then."""
    demand = _demand(robot, 2.0)
    together = solve_box(contact_wrench._box(demand, barrier)).x
    for step in (0, 17, 40):
        alone = solve_box(contact_wrench._box(demand.at(np.array([step])), barrier)).x
        np.testing.assert_allclose(alone[0], together[step], rtol=1e-9, atol=1e-12)


def test_a_start_of_another_problem_is_not_taken(robot: Robot):
    """A hinge that leaves its stop has a limit that the start knows nothing of."""
    demand = _demand(robot)
    stopped = replace(demand, upper=np.full_like(demand.upper, np.inf))
    start = contact_wrench.relaxed(stopped, BARRIER).point
    warm = contact_wrench.relaxed(demand, BARRIER, start)
    np.testing.assert_allclose(warm.value, contact_wrench.relaxed(demand, BARRIER).value, atol=1e-6)


def test_a_hinge_on_its_stop_needs_no_motor_to_stay_there(robot: Robot):
    qpos = np.tile(robot.standing, (5, 1))
    knee = robot.joint_names.index("left_knee")
    qpos[:, 7 + knee] = robot.upper[knee]  # straight: the stop pushes back, towards bending
    force = np.zeros((5, robot.model.nv))
    demand = inverse_dynamics.demand(robot, qpos, force, np.zeros((5, 2), bool), Tolerance())
    assert np.isinf(demand.lower[:, knee]).all()
    np.testing.assert_allclose(demand.upper[:, knee], robot.torque_limit[knee])


@pytest.mark.parametrize("tempo", [0.5, 0.8])
def test_the_force_at_another_tempo_is_that_of_the_slower_motion(tempo: float, robot: Robot):
    """mj_inverse with velocities times k and accelerations times k^2."""
    motion = robot_motion("walk")
    parts = inverse_dynamics.free_space(robot, motion.qpos, motion.dt, motion.cycle_offset)
    from robojackson.robot.resampling import accelerations, velocities

    speed = tempo * velocities(motion.qpos, motion.dt, motion.cycle_offset)
    rate = tempo**2 * accelerations(motion.qpos, motion.dt, motion.cycle_offset)
    slower = inverse_dynamics.inverse(unconstrained(robot), motion.qpos, speed, rate)
    np.testing.assert_allclose(parts.at(tempo), slower, atol=1e-6)


def test_edges_are_forces_on_the_lowest_points(robot: Robot, poses: np.ndarray):
    """Virtual work: moving a sole's point by J dq against a push is the generalised force."""
    posed = pose(tree(robot), poses)
    feet, spread = inverse_dynamics.wrenches(robot, posed)
    columns = feet @ spread
    nudge = np.zeros((len(poses), robot.model.nv))
    nudge[:, 9] = 1e-6
    moved = pose(tree(robot), integrate(poses, nudge))
    turn = moved.body_rot[:, robot.contact_bodies] @ posed.body_rot[
        :, robot.contact_bodies
    ].swapaxes(2, 3)
    arm = np.array([0.0, 0.0, -robot.contact_radii[0]])
    path = moved.ball_pos - posed.ball_pos + (turn @ arm) - arm
    work = np.einsum("sci,cie->sce", path / 1e-6, inverse_dynamics.directions(robot)).reshape(
        len(poses), -1
    )
    np.testing.assert_allclose(columns[:, 9], work, atol=1e-4)
