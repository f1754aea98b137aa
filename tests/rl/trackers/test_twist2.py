"""TWIST2's layout: what the network sees is written a second time, with scipy, joint by joint."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.rl.sim.reference_clip import ClipStep
from robojackson.rl.trackers import twist2
from robojackson.rl.trackers.tracker import TrackerInput
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.model import Robot
from tests.fixtures.robots import stock
from tests.fixtures.stand_in_tracker import stand_in

N = 3


class Spy:
    """A network that keeps what it gets and says something larger than the limit of actions."""

    def __init__(self, joints: int) -> None:
        self.seen: list[np.ndarray] = []
        self.action = np.linspace(-3.0, 3.0, joints) + np.arange(N)[:, None]

    def __call__(self, values: np.ndarray) -> np.ndarray:
        self.seen.append(values.copy())
        return self.action


@pytest.fixture
def made(tmp_path: Path) -> tuple[twist2.Twist2Tracker, TrackerDescription]:
    file, description = stand_in(tmp_path)
    return twist2.Twist2Tracker(description, file), description


def random_state(robot: Robot, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    qpos, qvel = rng.normal(size=(N, robot.model.nq)), rng.normal(size=(N, robot.model.nv))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    return qpos, qvel


def step_of(qpos: np.ndarray, qvel: np.ndarray) -> ClipStep:
    nothing = np.zeros((N, 14, 3))
    return ClipStep(np.zeros(N, int), qpos, qvel, nothing, nothing, np.zeros(N))


def target_by_hand(robot: Robot, joints: tuple[str, ...], qpos: np.ndarray, qvel: np.ndarray):
    """Return one robot's target, number by number."""
    turn = Rotation.from_quat(qpos[[4, 5, 6, 3]])
    velocity = turn.inv().apply(qvel[:3])
    _, pitch, roll = turn.as_euler("ZYX")
    angles = [qpos[robot.model.joint(name).qposadr[0]] for name in joints]
    return [velocity[0], velocity[1], qpos[2], roll, pitch, qvel[5], *angles]


def frame_by_hand(robot, description, target, qpos, qvel, action):
    """Return one robot's frame, number by number, with the stand-in's default pose and silent
    knees."""
    default = {"right_knee": -0.4, "left_knee": -0.4, "left_elbow": -1.0, "abdomen_z": 0.1}
    _, pitch, roll = Rotation.from_quat(qpos[[4, 5, 6, 3]]).as_euler("ZYX")
    frame = [*target, *(0.25 * qvel[3:6]), roll, pitch]
    for name in description.joints:
        frame.append(qpos[robot.model.joint(name).qposadr[0]] - default.get(name, 0.0))
    for name in description.joints:
        silent = name.endswith("_knee")
        frame.append(0.0 if silent else 0.05 * qvel[robot.model.joint(name).dofadr[0]])
    return [*frame, *action]


def test_the_observation_of_the_g1_has_the_length_of_the_published_network() -> None:
    assert twist2.observation_size(29) == 1432


def test_the_network_sees_frame_history_and_target_as_they_are_written_by_hand(made) -> None:
    tracker, description = made
    robot, rng = stock(), np.random.default_rng(0)
    spy = Spy(len(description.joints))
    tracker._network = spy
    follower = tracker.follow(robot, N)
    frames: list[list[float]] = []
    action = np.zeros_like(spy.action)
    for count in range(13):
        qpos, qvel = random_state(robot, rng)
        selected = random_state(robot, rng)
        follower.targets(TrackerInput(qpos, qvel, np.zeros((N, 14, 3)), (step_of(*selected),)))
        target = target_by_hand(robot, description.joints, selected[0][1], selected[1][1])
        frame = frame_by_hand(robot, description, target, qpos[1], qvel[1], action[1])
        past = frames[-10:] if frames else []
        past = [(frames or [frame])[0]] * (10 - len(past)) + past
        np.testing.assert_allclose(
            spy.seen[-1][1], [*frame, *np.ravel(past), *target], atol=1e-12, err_msg=str(count)
        )
        frames.append(frame)
        action = spy.action  # as the network gives it, not as it is limited


def test_an_action_is_limited_scaled_and_added_to_the_default_pose(made) -> None:
    tracker, description = made
    robot, rng = stock(), np.random.default_rng(1)
    spy = Spy(len(description.joints))
    tracker._network = spy
    result = tracker.follow(robot, N).targets(
        TrackerInput(
            *random_state(robot, rng), np.zeros((N, 14, 3)), (step_of(*random_state(robot, rng)),)
        )
    )
    default = {"right_knee": -0.4, "left_knee": -0.4, "left_elbow": -1.0, "abdomen_z": 0.1}
    for motor in range(robot.model.nu):
        name = robot.model.joint(robot.model.actuator_trnid[motor, 0]).name
        action = spy.action[:, description.joints.index(name)]
        expected = default.get(name, 0.0) + 0.5 * np.minimum(np.maximum(action, -2.0), 2.0)
        np.testing.assert_allclose(result[:, motor], expected, err_msg=name)


def test_a_network_that_says_zero_holds_the_default_pose(tmp_path: Path) -> None:
    file, description = stand_in(tmp_path, scale=0.0)
    robot, rng = stock(), np.random.default_rng(2)
    follower = twist2.Twist2Tracker(description, file).follow(robot, N)
    names = [robot.model.joint(i).name for i in robot.model.actuator_trnid[:, 0]]
    held = {"right_knee": -0.4, "left_knee": -0.4, "left_elbow": -1.0, "abdomen_z": 0.1}
    for _ in range(3):
        state, reference = random_state(robot, rng), random_state(robot, rng)
        result = follower.targets(
            TrackerInput(*state, np.zeros((N, 14, 3)), (step_of(*reference),))
        )
        np.testing.assert_allclose(result, [[held.get(name, 0.0) for name in names]] * N)


def test_robots_that_begin_together_move_as_if_each_was_alone(made) -> None:
    tracker, _ = made
    robot, rng = stock(), np.random.default_rng(4)
    states = [(random_state(robot, rng), random_state(robot, rng)) for _ in range(4)]
    together, alone = tracker.follow(robot, N), tracker.follow(robot, 1)
    points = np.zeros((N, 14, 3))
    for state, reference in states:
        result = together.targets(TrackerInput(*state, points, (step_of(*reference),)))
        one = ClipStep(np.zeros(1, int), *(a[1:2] for a in reference), points[:1], points[:1],
                       np.zeros(1))  # fmt: skip
        single = alone.targets(TrackerInput(state[0][1:2], state[1][1:2], points[:1], (one,)))
        np.testing.assert_allclose(result[1:2], single, atol=1e-6)
