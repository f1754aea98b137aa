"""Mirror images of the motions that the dancer learns, and of the feedback along them."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.feedback.feedback_law import Feedback
from robojackson.rl.feedback.nominal_path import Gains
from robojackson.rl.feedback.standing_feet import Feet, Sites
from robojackson.rl.sim.motors import Motors
from robojackson.robot.model import Robot
from tests.fixtures.robots import robot_motion, stock
from tests.tools.test_dancer_experts import gains
from tests.tools.test_dancer_learning import motions
from tools.dancer.mirror import ACROSS, Images, hinge_partners, partners


@pytest.fixture
def robot() -> Robot:
    return stock()


@pytest.mark.parametrize("name", ["hip_shake", "walk"])
def test_the_keypoints_of_a_motion_s_image_are_where_its_poses_put_them(
    robot: Robot, name: str
) -> None:
    motion = robot_motion(name)
    image = Images(robot).motion(motion)
    placed = Sites(robot, robot.keypoint_sites).at(np.asarray(image.qpos))
    np.testing.assert_allclose(placed, image.keypoints_w, atol=2e-3)
    assert np.abs(image.keypoints_w - motion.keypoints_w).max() > 0.02, "no other motion"
    travel = np.diff(np.asarray(image.qpos)[:, :2], axis=0) / image.dt
    np.testing.assert_allclose(travel.mean(0), np.asarray(image.qvel)[:, :2].mean(0), atol=0.05)


def test_an_image_s_image_is_the_motion(robot: Robot) -> None:
    images, motion = Images(robot), motions()["ends"]
    twice = images.motion(images.motion(motion))
    for name in ("qpos", "qvel", "keypoints_w", "body_pos_w", "contact", "torque_ratio"):
        np.testing.assert_allclose(getattr(twice, name), getattr(motion, name), err_msg=name)


def advice(robot: Robot, law: Gains, qpos: np.ndarray, qvel: np.ndarray, row: int) -> np.ndarray:
    """Return the offsets of the targets at a step of a law."""
    feedback = Feedback(law, np.full(robot.model.nu, np.inf), Feet(robot))
    step = feedback.at(np.array([row]), np.zeros((1, 3)))
    return np.asarray(step.targets(qpos[None], qvel[None])[0])


@pytest.mark.parametrize("share", [0.25, 0.75])  # followed from the feet, and in the world
def test_the_image_of_a_robot_is_driven_by_the_image_of_the_feedback(
    robot: Robot, share: float
) -> None:
    law, rng = gains(), np.random.default_rng(8)
    row = int(share * len(law.qpos))
    state = replace(law, qpos=law.qpos + 0.0, qvel=law.qvel + 0.0)
    state.qpos[row, 7:] += 0.1 * rng.normal(size=robot.model.nq - 7)
    state.qpos[row, :3] += 0.05
    turn = np.array([1.0, 0.05, -0.04, 0.1])
    state.qpos[row, 3:7] = turn / np.linalg.norm(turn)
    state.qvel[row] += rng.normal(size=robot.model.nv)
    images = Images(robot)
    seen = images.gains(state)
    expected = advice(robot, law, state.qpos[row], state.qvel[row], row)
    found = advice(robot, images.gains(law), seen.qpos[row], seen.qvel[row], row)
    hinge, sign = hinge_partners(robot)
    motors = list(Motors.of(robot.model).hinge)
    for motor, angle in zip(motors, found, strict=True):
        partner = expected[motors.index(hinge[motor])]
        assert angle == pytest.approx(sign[motor] * partner, abs=1e-9)
    assert np.abs(found - expected).max() > 1e-3, "the law is its own image"


def test_left_and_right_change_places(robot: Robot) -> None:
    motion: ReferenceMotion = motions()["ends"]
    image, names = Images(robot).motion(motion), motion.body_names
    other = partners(names)
    left = names.index(next(name for name in names if "left" in name))
    assert names[other[left]] != names[left]
    np.testing.assert_allclose(
        np.asarray(image.body_pos_w)[:, left],
        np.asarray(motion.body_pos_w)[:, other[left]] * ACROSS,
    )
