"""Refined paths: physics follows them, and each is nearer to the motion than the one before."""

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.feedback import path_refinement
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.feedback.nominal_path import Linear, Path, Pull
from robojackson.rl.feedback.path_refinement import refinements
from robojackson.rl.feedback.regulator import advance, following, linearised, regulator, riccati
from robojackson.rl.feedback.standing_feet import Feet
from robojackson.rl.sim.motors import residual_scale
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.sim.tangent import state_difference
from robojackson.robot.model import Robot

pytestmark = [pytest.mark.medium, pytest.mark.xdist_group("path_refinement")]
LED = ControlConfig(feedforward=1.0, feedback=0.0)
STEPS = 20


@pytest.fixture(scope="module")
def action(robot: Robot) -> np.ndarray:
    return residual_scale(robot, ControlConfig())


@pytest.fixture(scope="module")
def sim(robot: Robot) -> Simulation:
    return Simulation(robot, LED, 1)


@pytest.fixture(scope="module")
def motion(robot: Robot, sway: ReferenceMotion, sim: Simulation, action: np.ndarray) -> Path:
    clip = driven_clip(robot, sway, LED)
    _, path, _ = regulator(sim, clip, action, Feet(robot).count)
    return Path(path.qpos[:STEPS], path.qvel[:STEPS], path.targets[:STEPS])


def followed(sim: Simulation, qpos: np.ndarray, qvel: np.ndarray, targets: np.ndarray) -> Path:
    """Return what a robot does from a state under targets."""
    states = [(qpos[None], qvel[None])]
    for aim in targets[:-1]:
        states.append(advance(sim, *states[-1], aim[None]))
    return Path(*(np.concatenate(part) for part in zip(*states, strict=True)), targets)


@pytest.fixture(scope="module")
def noisy(sim: Simulation, motion: Path, action: np.ndarray) -> tuple[Path, Linear]:
    """A path beside the motion, as a search finds it, and the system along it."""
    offsets = 0.5 * action * np.random.default_rng(0).normal(size=motion.targets.shape)
    path = followed(sim, motion.qpos[0], motion.qvel[0], motion.targets + offsets)
    return path, linearised(sim, path, following(path))


def distance(path: Path, motion: Path) -> float:
    """Return the root mean square of the hinges' distance, rad."""
    off = state_difference(path.qpos, path.qvel, motion.qpos, motion.qvel)
    return float(np.sqrt((off[:, 6 : off.shape[1] // 2] ** 2).mean()))


def test_each_path_is_nearer_to_the_motion_and_one_that_the_physics_follows(
    sim: Simulation, motion: Path, noisy: tuple[Path, Linear], action: np.ndarray
) -> None:
    path, linear = noisy
    found = [one for one, _ in refinements(sim, path, linear, motion, action)]
    assert 1 <= len(found) <= path_refinement.ROUNDS
    costs = [path_refinement._cost(one, motion, action) for one in (path, *found)]
    assert (np.diff(costs) <= -path_refinement.LEAST_GAIN * np.array(costs[:-1])).all(), costs
    assert distance(found[-1], motion) < 0.75 * distance(path, motion)
    for one in found:
        again = followed(sim, path.qpos[0], path.qvel[0], one.targets)
        np.testing.assert_allclose(one.qpos, again.qpos, atol=1e-9)
        lead = np.abs(one.targets - motion.targets)[:-1]
        assert (lead <= path_refinement.LARGEST_LEAD * action + 1e-9).all()


def test_a_path_that_cannot_come_nearer_ends_the_refinement(
    sim: Simulation, motion: Path, noisy: tuple[Path, Linear], action: np.ndarray
) -> None:
    path, linear = noisy
    *_, (path, linear) = refinements(sim, path, linear, motion, action)
    for _ in range(5):
        found = list(refinements(sim, path, linear, motion, action))
        if not found:
            return
        path, linear = found[-1]
    pytest.fail("the cost still falls")


def test_a_pull_moves_the_offsets_and_not_the_gains(
    noisy: tuple[Path, Linear], motion: Path, action: np.ndarray
) -> None:
    path, linear = noisy
    exact = Linear(linear.by_state, linear.by_target, 0.0 * linear.defect)
    plain = riccati(exact, action, cyclic=False)
    none = Pull(np.zeros_like(linear.defect), np.zeros_like(path.targets))
    np.testing.assert_array_equal(riccati(exact, action, False, none).offset, 0.0 * plain.offset)
    pulled = riccati(exact, action, False, path_refinement._pull(path, motion, action))
    np.testing.assert_array_equal(pulled.gain, plain.gain)
    assert np.abs(pulled.offset).max() > 0.01
