import dataclasses

import mujoco
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env as check_gymnasium
from stable_baselines3.common.env_checker import check_env as check_sb3

from robojackson.errors import BadPolicy, UnknownName
from robojackson.geometry.rotations import heading
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.track_config import RandomConfig
from robojackson.rl.config.train_config import (
    ResetConfig,
    RewardConfig,
    TrackConfig,
)
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.env.vec_env import TrackingEnv, TrackingVecEnv
from robojackson.rl.modes.reset_states import StartPhases, default_standing_pose, standing_pose_at
from robojackson.rl.modes.rewards import (
    TrackedPoints,
    reward_terms,
    tracked_points,
    tracking_errors,
)
from robojackson.rl.modes.track_mode import SETTLED_STATES_NEEDED
from robojackson.rl.sim.reference_clip import Clip
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import tree

WHICH = TrackedPoints(pelvis=0, hands=(11, 12, 13), limbs=(5, 6, 11, 12, 13))


def core(robot: Robot, sway: ReferenceMotion, n: int = 4, seed: int = 0) -> TrackingCore:
    return TrackingCore(robot, sway, TrackConfig(), n, seed)


def reward_at(
    sway: ReferenceMotion, qpos: np.ndarray, qvel: np.ndarray, points: np.ndarray, rush: float = 0.0
) -> float:
    target = Clip(sway).at(np.array([10]))
    errors = tracking_errors(
        qpos[None], qvel[None], points[None], target.moved + rush, target, WHICH
    )
    terms = reward_terms(errors, np.zeros(1), RewardConfig())
    return float(sum(term[0] for term in terms.values()))


def test_gymnasium_accepts_the_environment(robot: Robot, sway: ReferenceMotion) -> None:
    check_gymnasium(TrackingEnv(robot, sway, TrackConfig()), skip_render_check=True)


def test_stable_baselines_accepts_the_environment(robot: Robot, sway: ReferenceMotion) -> None:
    check_sb3(TrackingEnv(robot, sway, TrackConfig()), skip_render_check=True)


def test_the_same_seed_gives_the_same_rollout(robot: Robot, sway: ReferenceMotion) -> None:
    runs = []
    for _ in range(2):
        env = core(robot, sway, seed=7)
        env.reset()
        actions = np.random.default_rng(1).uniform(-1, 1, (30, 4, robot.model.nu))
        runs.append(np.array([env.step(action).observation for action in actions]))
    np.testing.assert_array_equal(runs[0], runs[1])


def test_another_seed_gives_another_rollout(robot: Robot, sway: ReferenceMotion) -> None:
    first, second = core(robot, sway, seed=1).reset(), core(robot, sway, seed=2).reset()
    assert not np.allclose(first, second)


def test_observations_share_no_memory_with_the_environment(
    robot: Robot, sway: ReferenceMotion
) -> None:
    env = core(robot, sway)
    before = env.reset()
    kept = before.copy()
    env.step(np.zeros((4, robot.model.nu)))
    np.testing.assert_array_equal(before, kept)


def test_the_reward_is_greatest_at_the_reference(sway: ReferenceMotion) -> None:
    best = reward_at(sway, sway.qpos[10], sway.qvel[10], sway.keypoints_w[10])
    rng = np.random.default_rng(0)
    for _ in range(50):
        qpos = sway.qpos[10] + rng.normal(0, 0.05, sway.qpos.shape[1])
        qpos[3:7] /= np.linalg.norm(qpos[3:7])
        qvel = sway.qvel[10] + rng.normal(0, 0.5, sway.qvel.shape[1])
        points = sway.keypoints_w[10] + rng.normal(0, 0.05, sway.keypoints_w[10].shape)
        assert reward_at(sway, qpos, qvel, points) < best
    weights = [getattr(RewardConfig(), f.name.removesuffix("_width")) for f in
               dataclasses.fields(RewardConfig()) if f.name.endswith("_width")]  # fmt: skip
    assert best == pytest.approx(sum(weights))


@pytest.mark.parametrize("term", RewardConfig.terms())
def test_an_error_costs_every_term(robot: Robot, sway: ReferenceMotion, term: str) -> None:
    """Paid alone it is its weight at the reference, and next to nothing where all is wrong."""
    config = RewardConfig(**{name: float(name == term) for name in RewardConfig.terms()})
    target, rng = Clip(sway).at(np.array([10])), np.random.default_rng(0)
    right = (target.qpos, target.qvel, target.points, target.moved)
    wrong = [state + rng.normal(0, 2.0, state.shape) for state in right]
    wrong[0][:, 3:7] /= np.linalg.norm(wrong[0][:, 3:7])
    which = tracked_points(sway.keypoint_names, tree(robot))
    paid = [
        reward_terms(tracking_errors(*states, target, which), np.zeros(1), config)[term][0]
        for states in (right, wrong)
    ]
    assert paid == [pytest.approx(1.0), pytest.approx(0.0, abs=0.5)]


def test_a_training_pays_for_the_orientations_of_bodies_if_weighted(
    robot: Robot, sway: ReferenceMotion
) -> None:
    paid = []
    for weight in (0.0, 0.5):
        config = TrackConfig(reward=RewardConfig(bodies=weight))
        env = TrackingCore(robot, sway, config, 4, 0)
        env.reset()
        paid.append(env.step(np.zeros((4, robot.model.nu))).terms["bodies"])
    assert not paid[0].any()
    assert (paid[1] > 0.05).all()
    assert (paid[1] < 0.5).all()


def test_the_hands_are_compared(sway: ReferenceMotion) -> None:
    """A hand in the wrong place costs reward although every body origin is right."""
    best = reward_at(sway, sway.qpos[10], sway.qvel[10], sway.keypoints_w[10])
    points = sway.keypoints_w[10].copy()
    points[sway.keypoint_names.index("left_hand")] += 0.2
    assert reward_at(sway, sway.qpos[10], sway.qvel[10], points) < best - 0.05


def test_flailing_costs_reward_even_in_the_right_pose(sway: ReferenceMotion) -> None:
    state = (sway.qpos[10], sway.qvel[10], sway.keypoints_w[10])
    assert reward_at(sway, *state, rush=0.5) < reward_at(sway, *state) - 0.05


def test_a_reference_with_another_skeleton_is_refused(robot: Robot, sway: ReferenceMotion) -> None:
    other = dataclasses.replace(sway, keypoint_names=("left_hnad", *sway.keypoint_names[1:]))
    with pytest.raises(UnknownName, match=r"left_hnad.*Known:.*left_hand"):
        core(robot, other)


def test_a_cyclic_clip_goes_on_with_continuous_state(sway: ReferenceMotion) -> None:
    moved = dataclasses.replace(sway, cycle_offset=np.array([0.5, 0.1, 0.0]))
    clip = Clip(moved)
    before, after = clip.at(np.array([79])), clip.at(np.array([80]))
    np.testing.assert_allclose(after.qpos[0, :2], moved.qpos[0, :2] + [0.5, 0.1])
    np.testing.assert_allclose(after.qpos[0, 2:], moved.qpos[0, 2:])
    assert np.abs(after.qvel - before.qvel).max() < 0.5


def test_a_clip_that_is_not_cyclic_ends_its_episode_without_bootstrap(
    robot: Robot, sway: ReferenceMotion
) -> None:
    env = core(robot, dataclasses.replace(sway, cyclic=False), n=2)
    put(env, sway, step=78)
    result = env.step(np.zeros((2, robot.model.nu)))
    assert result.terminated.all()
    assert not result.truncated.any()


def test_the_time_limit_is_a_truncation_and_is_bootstrapped(
    robot: Robot, sway: ReferenceMotion
) -> None:
    config = TrackConfig(episode_seconds=0.03)
    env = TrackingVecEnv(TrackingCore(robot, sway, config, 2, 0))
    env.reset()
    put(env.core, sway, step=10)
    env.step(np.zeros((2, robot.model.nu)))
    _, _, done, infos = env.step(np.zeros((2, robot.model.nu)))
    assert done.all()
    assert all(info["TimeLimit.truncated"] for info in infos)


def test_a_fall_is_no_truncation(robot: Robot, sway: ReferenceMotion) -> None:
    env = TrackingVecEnv(core(robot, sway, n=1))
    env.reset()
    lying = sway.qpos[10].copy()
    lying[2:7] = [0.3, np.cos(np.pi / 4), 0.0, np.sin(np.pi / 4), 0.0]
    env.core.sim.place(np.array([0]), lying[None], sway.qvel[10][None])
    _, _, done, infos = env.step(np.zeros((1, robot.model.nu)))
    assert done[0]
    assert infos[0]["TimeLimit.truncated"] is False


def test_a_state_that_blows_up_ends_its_episode(robot: Robot, sway: ReferenceMotion) -> None:
    env = core(robot, sway, n=1)
    env.reset()
    wild = np.full((1, robot.model.nv), 1e12)
    env.sim.place(np.array([0]), sway.qpos[:1], wild)
    assert env.step(np.zeros((1, robot.model.nu))).terminated[0]


def test_a_settled_state_comes_back_at_its_own_step_and_place(
    robot: Robot, sway: ReferenceMotion
) -> None:
    """A state kept on cycle 3 begins again on cycle 0, as far from its reference as it was."""
    moved = dataclasses.replace(sway, cycle_offset=np.array([0.5, 0.0, 0.0]))
    reset = ResetConfig(settled_share=1.0, stand_share=0.0)
    config = TrackConfig(episode_seconds=0.015, reset=reset)
    env = TrackingCore(robot, moved, config, SETTLED_STATES_NEEDED, 0)
    env.reset()
    put(env, moved, step=3 * 80 + 10, drift=0.07)
    ended = env.step(np.zeros((env.n, robot.model.nu)))
    assert ended.truncated.all()
    np.testing.assert_array_equal(env.step_index, 11)
    home = env.clip.at(env.step_index).qpos[:, :2]
    np.testing.assert_allclose(env.sim.qpos[:, :2] - home, [[0.07, 0.0]] * env.n, atol=0.02)


def test_the_default_stand_touches_the_floor_and_faces_as_requested(robot: Robot) -> None:
    stand = default_standing_pose(robot)
    turned = standing_pose_at(stand, np.array([1.0, 2.0, 9.0, np.cos(0.6), 0.0, 0.0, np.sin(0.6)]))
    data = mujoco.MjData(robot.model)
    data.qpos[:] = turned
    mujoco.mj_forward(robot.model, data)
    feet = data.site_xpos[robot.keypoint_sites][robot.contact_keypoints]
    np.testing.assert_allclose(feet[:, 2] - robot.contact_radii, 0.0, atol=1e-9)
    np.testing.assert_allclose(turned[:2], [1.0, 2.0])
    assert heading(turned[3:7]) == pytest.approx(1.2)


@pytest.mark.parametrize(
    "random", [RandomConfig(), RandomConfig(sensor_noise=1.0, pushes=1.0)], ids=["plain", "noisy"]
)
def test_a_seed_decides_everything_after_it(
    robot: Robot, sway: ReferenceMotion, random: RandomConfig
) -> None:
    one = TrackingCore(robot, sway, TrackConfig(observation="onboard", random=random), 4, 0)
    seen = []
    for _ in range(2):
        one.reseed(7)
        first = one.reset()
        still = np.zeros((4, one.action_size))
        seen.append([first, *(one.step(still).observation for _ in range(90))])
    np.testing.assert_array_equal(*seen)


def test_environments_without_a_seed_begin_differently(robot: Robot, sway: ReferenceMotion) -> None:
    first, second, third, same = (TrackingEnv(robot, sway, TrackConfig()) for _ in range(4))
    assert not np.array_equal(first.reset()[0], second.reset()[0])
    np.testing.assert_array_equal(third.reset(seed=3)[0], same.reset(seed=3)[0])
    np.testing.assert_array_equal(third.reset()[0], same.reset()[0])


def test_start_phases_go_where_episodes_fail(sway: ReferenceMotion) -> None:
    phases = StartPhases(Clip(sway), failure_share=1.0)
    for _ in range(300):
        phases.record(np.arange(80), np.arange(80) >= 64)
    drawn = phases.draw(2000, np.random.default_rng(0))
    assert np.mean(drawn >= 64) > 0.8
    assert drawn.max() < 80


def test_a_reference_for_another_control_rate_is_refused(
    robot: Robot, sway: ReferenceMotion
) -> None:
    with pytest.raises(BadPolicy, match="20 ms"):
        core(robot, dataclasses.replace(sway, dt=0.02))


@pytest.mark.parametrize(
    ("height", "tilt_deg", "falls"),
    [(0.71, 0, False), (0.69, 0, True), (1.2, 59, False), (1.2, 61, True)],
)
def test_the_fall_rule_is_the_papers(
    robot: Robot, sway: ReferenceMotion, height: float, tilt_deg: float, falls: bool
) -> None:
    qpos = sway.qpos[:1].copy()
    half = np.radians(tilt_deg) / 2
    qpos[0, 2:7] = [height, np.cos(half), np.sin(half), 0, 0]
    assert bool(Fall.of(robot).has_fallen(qpos, qpos)[0]) is falls


def test_an_episode_that_ends_hands_out_its_own_last_observation(
    robot: Robot, sway: ReferenceMotion
) -> None:
    """The terminal observation is of the state before the reset, not of the new episode."""
    env = TrackingVecEnv(core(robot, sway, n=1))
    env.reset()
    lying = sway.qpos[10].copy()
    lying[2:7] = [0.3, np.cos(np.pi / 4), 0.0, np.sin(np.pi / 4), 0.0]
    env.core.sim.place(np.array([0]), lying[None], np.zeros((1, robot.model.nv)))
    after, _, done, infos = env.step(np.zeros((1, robot.model.nu)))
    assert done[0]
    height = infos[0]["terminal_observation"][0] + 1.2
    assert height < 0.4
    assert after[0, 0] + 1.2 > 0.7


def put(env: TrackingCore, sway: ReferenceMotion, step: int, drift: float = 0.0) -> None:
    """Put all robots on the reference at a step, the root moved along x by the drift."""
    env.step_index[:] = step
    at = env.clip.at(env.step_index)
    qpos = at.qpos.copy()
    qpos[:, 0] += drift
    env.sim.place(np.arange(env.n), qpos, at.qvel)
