"""The dancer's experts, rehearsals and network: mirror images, advice, and learning from it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.modes.observation import Observer
from robojackson.rl.policy import Policy, load_policy
from robojackson.rl.sim.preview import preview_of
from robojackson.rl.sim.reference_clip import Clip
from robojackson.robot.model import Robot
from tests.fixtures.robots import robot_motion, stock
from tools.dancer import distil, experts
from tools.dancer.imitation import Memory, Student
from tools.dancer.mirror import ACROSS, ObservationMirror, hinge_partners, mirrored
from tools.dancer.rehearsal import Lessons, Rehearsal

STEPS = np.array([3, 30, 75])


@pytest.fixture
def rng() -> np.random.Generator:
    """Return a seeded generator."""
    return np.random.default_rng(7)


def short(seconds: float = 0.6) -> ReferenceMotion:
    """Return the beginning of dance_b, on the stock robot."""
    motion = robot_motion("dance_b")
    rows = slice(0, round(seconds / motion.dt))
    names = ("qpos", "qvel", "body_pos_w", "keypoints_w", "contact", "torque_ratio")
    return replace(motion, **{name: getattr(motion, name)[rows] for name in names})


def observed(
    motion: ReferenceMotion, qpos: np.ndarray, qvel: np.ndarray, last: np.ndarray
) -> np.ndarray:
    """Return observations `preview` of three states."""
    robot = stock()
    observer = Observer(robot, "preview")
    step = Clip(motion, None, preview_of(motion, robot)).at(STEPS)
    points = np.zeros((len(STEPS), len(robot.keypoint_names), 3))
    return observer.observe(qpos, qvel, points, step, last)[:, : observer.actor_size]


def test_a_mirrored_observation_is_that_of_the_mirrored_robot(rng: np.random.Generator) -> None:
    robot, motion = stock(), robot_motion("dance_b")
    qpos = motion.qpos[STEPS] + rng.normal(0, 0.1, (3, robot.model.nq))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    qvel, last = rng.normal(size=(3, robot.model.nv)), rng.uniform(-1, 1, (3, robot.model.nu))
    partner, sign = hinge_partners(robot)
    image_qpos, image_qvel = qpos.copy(), qvel.copy()
    for values, hinges in ((image_qpos, 7), (image_qvel, 6)):
        values[:, hinges:] = values[:, hinges:][:, partner] * sign
        values[:, :3] *= ACROSS
    image_qpos[:, 3:7] *= [1.0, -1.0, 1.0, -1.0]
    image_qvel[:, 3:6] *= -ACROSS
    mirror = ObservationMirror.of(robot)
    image = observed(mirrored(motion, robot), image_qpos, image_qvel, mirror.action(last))
    np.testing.assert_allclose(
        mirror.observation(observed(motion, qpos, qvel, last)), image, atol=1e-5
    )
    np.testing.assert_allclose(mirror.action(mirror.action(last)), last)


@pytest.mark.medium
def test_a_rehearsal_returns_what_the_expert_would_do(rng: np.random.Generator) -> None:
    robot, motion = stock(), short()
    gains = made_up_gains(robot, motion)
    rehearsal = Rehearsal(robot, [motion], [gains], 4, 0)
    lessons = rehearsal.run(lambda seen: np.zeros((len(seen), robot.model.nu)), 1.0, 6)
    assert lessons.seen.shape[1] == rehearsal.size[0]
    assert len(lessons.seen) == len(lessons.advice) > 0
    expected = -gains.offset[0] / Rehearsal(robot, [motion], [gains], 1, 0).full_action
    np.testing.assert_allclose(
        lessons.advice, np.tile(expected, (len(lessons.advice), 1)), atol=2e-3
    )


def made_up_gains(robot: Robot, motion: ReferenceMotion) -> experts.Gains:
    """Return an expert that moves every target by the same angle, wherever the robot is."""
    steps, motors = len(motion), robot.model.nu
    feet = experts.Feet(robot).places(np.asarray(motion.qpos, float))
    return experts.Gains(
        np.zeros((steps, motors, 2 * robot.model.nv)),
        np.full((steps, motors), 0.02),
        np.asarray(motion.qpos, float),
        np.asarray(motion.qvel, float),
        feet,
    )


def test_a_student_learns_advice_and_its_mirror_image(rng: np.random.Generator) -> None:
    mirror = ObservationMirror.of(stock())
    size, motors = len(mirror.source), len(mirror.action_source)
    seen = rng.normal(size=(256, size)).astype(np.float16)
    advice = np.tanh(0.3 * seen[:, :motors]).astype(np.float16)
    memory = Memory(200, size, motors)
    memory.add(Lessons(seen, advice, 1.0), rng)
    assert memory.count == 200
    student = Student(size, motors, (32,), mirror, 0)
    first = student.learn(memory, 5, 3e-3, rng)
    assert student.learn(memory, 60, 3e-3, rng) < 0.7 * first


def test_the_file_of_a_student_acts_as_the_student(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    robot = stock()
    mirror = ObservationMirror.of(robot)
    student = Student(len(mirror.source), len(mirror.action_source), (16, 8), mirror, 0)
    distil.save(tmp_path, student, distil.facts(robot, 0, 1, 10, 1))
    policy: Policy = load_policy(tmp_path / "policy.safetensors")
    seen = rng.normal(size=(5, len(mirror.source))).astype(np.float32)
    np.testing.assert_allclose(policy.act(seen), student.act(seen), atol=1e-5)


def test_experts_are_written_and_read_alike(tmp_path: Path) -> None:
    gains = made_up_gains(stock(), short())
    experts.save(gains, tmp_path / "one.npz")
    again = experts.load(tmp_path / "one.npz")
    np.testing.assert_allclose(again.qpos, gains.qpos, atol=1e-6)
    np.testing.assert_allclose(again.places, gains.places, atol=1e-6)
    assert [path.name for path in tmp_path.iterdir()] == ["one.npz"]


def test_experts_of_held_out_motions_are_refused(tmp_path: Path) -> None:
    (tmp_path / "dance_b.npz").touch()
    with pytest.raises(ValueError, match="not for training: dance_b"):
        distil.taught(tmp_path, tmp_path)
