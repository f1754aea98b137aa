"""The paper's mode: stock Humanoid-v5 to the bit, and its reward term by term."""

import dataclasses
import re
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env as check_gymnasium
from stable_baselines3.common.env_checker import check_env as check_sb3

from robojackson.errors import BadConfiguration, UnknownName
from robojackson.geometry.rotations import heading, quat_angle
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.configuration_files import names
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.config.train_config import PaperConfig, TrackConfig, TrainConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.env.vec_env import TrackingEnv
from robojackson.rl.evaluation.reward_audit import audit_both_readings, audit_reward
from robojackson.rl.modes.paper_mode import PaperPoints, facing_ahead
from robojackson.rl.modes.paper_reward import Miss, PaperState, has_fallen, miss, paper_terms, ramp
from robojackson.rl.modes.standing_motion import make_standing_motion
from robojackson.rl.sim.trainable import require_trainable
from robojackson.robot.model import Robot, load_robot
from tests.fixtures.own_robot import own_robot

WALKER = PaperConfig(preset="walker", reset_noise=0.0)


def state(**changed: np.ndarray) -> PaperState:
    """Return one robot that stands as it should: its point at (1, 0, 1), its pelvis under its
    COM."""
    usual = {
        "points": np.array([[[1.0, 0.0, 1.0], [0.0, 0.0, 2.0]]]),
        "root": np.array([[0.0, 0.0, 1.0]]),
        "com": np.array([[0.0, 0.0, 1.2]]),
        "upright": np.ones(1),
        "height": np.full(1, 1.3),
        "hinge_speed": np.array([[1.0, -2.0, 0.5]]),
        "spin": np.full(1, 7.0),
    }
    return PaperState(**(usual | changed))


def terms(config: PaperConfig, seen: PaperState, apart: float = 0.0, lambda_: float = 1.0) -> dict:
    found = paper_terms(
        seen, Miss(np.full(1, apart), np.full(1, 2 * apart)), np.zeros(1, bool), lambda_, config
    )
    return {name: float(value[0]) for name, value in found.items()}


def core(
    robot: Robot, sway: ReferenceMotion, config: PaperConfig | None = None, n: int = 2
) -> TrackingCore:
    return TrackingCore(robot, sway, config or PaperConfig(), n, 0)


def test_paper_mode_is_gymnasiums_humanoid_to_the_bit(robot: Robot) -> None:
    """Observation and own reward of five whole steps, torques far from zero."""
    stock = gymnasium.make("Humanoid-v5").unwrapped
    stock.reset(seed=0)
    ours = TrackingCore(robot, make_standing_motion(robot), WALKER, 1, 0)
    ours.reset()
    stock.set_state(ours.sim.qpos[0], ours.sim.qvel[0])
    stock.data.qacc_warmstart[:] = 0
    for action in np.random.default_rng(1).uniform(-1, 1, (5, 1, robot.model.nu)):
        seen, reward, *_ = stock.step(0.4 * action[0])
        result = ours.step(action)
        np.testing.assert_array_equal(result.final_observation[0], seen.astype(np.float32))
        assert result.reward[0] == pytest.approx(reward, abs=1e-9)


def test_four_repeats_are_four_steps_of_gymnasiums_humanoid(robot: Robot) -> None:
    stock = gymnasium.make("Humanoid-v5").unwrapped
    stock.reset(seed=0)
    repeated = dataclasses.replace(WALKER, repeats=4)
    ours = TrackingCore(robot, make_standing_motion(robot), repeated, 1, 0)
    ours.reset()
    stock.set_state(ours.sim.qpos[0], ours.sim.qvel[0])
    stock.data.qacc_warmstart[:] = 0
    action = np.random.default_rng(2).uniform(-1, 1, (1, robot.model.nu))
    earned = sum(stock.step(0.4 * action[0])[1] for _ in range(4))
    assert ours.step(action).terms["own"][0] == pytest.approx(earned, abs=1e-9)


def test_gymnasium_accepts_the_papers_environment(robot: Robot, sway: ReferenceMotion) -> None:
    check_gymnasium(TrackingEnv(robot, sway, PaperConfig()), skip_render_check=True)


def test_stable_baselines_accepts_the_papers_environment(
    robot: Robot, sway: ReferenceMotion
) -> None:
    check_sb3(TrackingEnv(robot, sway, PaperConfig()), skip_render_check=True)


def test_the_reward_is_the_papers_formula_by_hand() -> None:
    leaning = state(upright=np.full(1, 0.5), com=np.array([[0.3, 0.4, 1.2]]))
    found = terms(PaperConfig(curiosity="formula"), leaning, apart=0.04, lambda_=0.5)
    assert found == pytest.approx(
        {"imitation": -0.02, "upright": 1.5, "balance": 2 / 1.5, "fall": 0.0, "curiosity": 0.35}
    )


@pytest.mark.parametrize(
    ("preset", "bonus"), [("formula", 0.35), ("algorithm", 0.175), ("released", 0.035)]
)
def test_curiosity_pays_the_sum_of_absolute_hinge_speeds(preset: str, bonus: float) -> None:
    found = terms(PaperConfig(curiosity=preset), state())  # type: ignore[arg-type]
    assert found["curiosity"] == pytest.approx(bonus)


def test_no_one_is_paid_for_hanging_upside_down() -> None:
    assert terms(PaperConfig(), state(upright=np.full(1, -0.8)))["upright"] == 0.0


def test_a_fall_costs_200_once() -> None:
    found = paper_terms(
        state(), Miss(np.zeros(1), np.zeros(1)), np.ones(1, bool), 1.0, PaperConfig()
    )
    assert found["fall"][0] == -200.0


def test_the_points_are_compared_as_the_option_says() -> None:
    """A body that is carried 0.3 m away misses nothing relative to the root."""
    here = state()
    away = here.points + [0.3, 0.0, 0.0]
    apart = miss(here, away, here.root + [0.3, 0.0, 0.0], np.array([1.0, 3.0]))
    assert apart.root[0] == pytest.approx(0.0)
    assert apart.world[0] == pytest.approx(0.09)


def test_the_weights_are_those_of_a_mean() -> None:
    here = state()
    selected = here.points.copy()
    selected[0, 0, 1] += 0.2
    apart = miss(here, selected, here.root, np.array([1.0, 3.0]))
    assert apart.world[0] == pytest.approx(0.04 / 4)


@pytest.mark.parametrize(
    ("episode", "most", "expected"),
    [(0, 1, 0.1), (100, 1, 0.1), (500, 1, 0.5), (2000, 1, 1.0), (5, 10, 0.1), (500, 10, 5.0)],
)
def test_the_curriculum_is_the_papers(episode: int, most: float, expected: float) -> None:
    assert ramp(episode, PaperConfig(lambda_max=most)) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("height", "upright", "falls"),
    [(0.71, 1.0, False), (0.69, 1.0, True), (1.2, 0.51, False), (1.2, 0.49, True)],
)
def test_the_fall_rule_of_paper_mode_is_the_papers(
    height: float, upright: float, falls: bool
) -> None:
    seen = state(height=np.full(1, height), upright=np.full(1, upright))
    assert bool(has_fallen(seen, PaperConfig())[0]) is falls


def test_an_action_of_four_repeats_moves_the_reference_by_four_steps(
    robot: Robot, sway: ReferenceMotion
) -> None:
    env = core(robot, sway, PaperConfig(repeats=4))
    env.reset()
    env.step(np.zeros((2, robot.model.nu)))
    np.testing.assert_array_equal(env.step_index, 4)


def test_an_episode_counts_actions_but_survives_seconds(
    robot: Robot, sway: ReferenceMotion
) -> None:
    env = core(robot, sway, PaperConfig(repeats=4, seconds=0.12), n=1)
    env.reset()
    rows = [r for _ in range(2) for r in env.step(np.zeros((1, robot.model.nu))).episodes]
    assert [row["episode_length"] for row in rows] == [2]
    assert rows[0]["survived_s"] == pytest.approx(8 * 0.015)


def test_the_end_of_a_motion_that_is_not_cyclic_ends_the_episode(
    robot: Robot, sway: ReferenceMotion
) -> None:
    brief = dataclasses.replace(
        sway,
        cyclic=False,
        **{n: getattr(sway, n)[:9] for n in ("qpos", "qvel", "keypoints_w", "body_pos_w")},
    )
    env = core(robot, brief, n=1)
    env.reset()
    ends = [env.step(np.zeros((1, robot.model.nu))).terminated[0] for _ in range(8)]
    assert ends == [False] * 7 + [True]


def test_early_falls_are_counted(robot: Robot, sway: ReferenceMotion) -> None:
    env = core(robot, sway, PaperConfig(fall_height=2.0))
    env.reset()
    first, second = (env.step(np.zeros((2, robot.model.nu))).episodes for _ in range(2))
    assert first[0]["train_early_falls"] == 2.0
    assert second[0]["train_early_falls"] == 4.0


def test_observations_of_paper_mode_share_no_memory(robot: Robot, sway: ReferenceMotion) -> None:
    env = core(robot, sway)
    before = env.reset()
    kept = before.copy()
    env.step(np.ones((2, robot.model.nu)))
    np.testing.assert_array_equal(before, kept)


def test_the_same_seed_gives_the_same_rollout_in_paper_mode(
    robot: Robot, sway: ReferenceMotion
) -> None:
    runs = []
    for _ in range(2):
        env = core(robot, sway)
        env.reset()
        actions = np.random.default_rng(1).uniform(-1, 1, (8, 2, robot.model.nu))
        runs.append(np.array([env.step(action).observation for action in actions]))
    np.testing.assert_array_equal(runs[0], runs[1])


def test_the_curriculum_goes_by_the_episodes_of_the_run(
    robot: Robot, sway: ReferenceMotion
) -> None:
    """After a thousand of them the same step costs ten times what it did in the beginning."""
    costs = []
    for episodes in (0, 1000):
        env = core(robot, sway, n=1)
        env.reset()
        env.episode = episodes
        costs.append(float(env.step(np.zeros((1, robot.model.nu))).terms["imitation"][0]))
    assert costs[0] < 0
    assert costs[1] == pytest.approx(10 * costs[0])


@pytest.mark.parametrize("weights", [{}, {"pelvis": 0.0}, {"pelvis": 1.0, "head": -1.0}])
def test_weights_that_weigh_nothing_are_refused(weights: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="one at least must count"):
        PaperConfig(weights=weights)


def altered(folder: Path, *changes: tuple[str, str]) -> Robot:
    """Return Humanoid-v5 with another model and no torque limits, as a user's own robot."""
    path = own_robot(folder)
    text = (folder / "model.xml").read_text()
    for old, new in changes:
        text = re.sub(old, new, text)
    (folder / "model.xml").write_text(text)
    return load_robot(dataclasses.replace(describe_robot(str(path)), torque_limits={}))


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        (("<motor [^>]*joint[^>]*/>", ""), "neither its MJCF nor torque_limits"),
        (
            ('<motor gear="100" joint="abdomen_y"', '<position joint="abdomen_y"'),
            "'abdomen_y' is no",
        ),
    ],
)
def test_a_robot_that_torques_do_not_move_is_refused_in_words(
    robot: Robot, tmp_path: Path, change: tuple[str, str], cause: str
) -> None:
    require_trainable(robot)
    with pytest.raises(BadConfiguration, match=f"not possible on robot 'mine' yet: .*{cause}"):
        require_trainable(altered(tmp_path, change))


@pytest.mark.medium
def test_a_robot_whose_spine_has_other_names_is_rewarded_without_it(
    sway: ReferenceMotion, tmp_path: Path
) -> None:
    other = altered(tmp_path, ('"lwaist"', '"belly"'))
    answer = tuple("belly" if name == "lwaist" else name for name in sway.body_names)
    audit = audit_both_readings(other, dataclasses.replace(sway, body_names=answer), PaperConfig())
    assert audit["root"].of["statue"] < 1.0


def test_the_order_in_which_points_are_weighed_changes_no_bit(
    robot: Robot, sway: ReferenceMotion
) -> None:
    """PostgreSQL orders the weights of a run that a worker takes."""
    usual = PaperConfig()
    turned = PaperConfig(weights=dict(sorted(usual.weights.items())))
    assert list(turned.weights) != list(usual.weights)
    here, there = (PaperPoints(robot, sway, config).weights for config in (usual, turned))
    np.testing.assert_array_equal(here, there)


def test_a_point_without_a_body_is_refused(robot: Robot, sway: ReferenceMotion) -> None:
    with pytest.raises(UnknownName, match=r"left_hnad.*paper\.weights.*Known:.*left_hand.*torso"):
        core(robot, sway, PaperConfig(weights={"left_hnad": 1.0}))


def test_the_motion_is_turned_ahead_without_being_bent(robot: Robot, sway: ReferenceMotion) -> None:
    turned = turned_by(sway, 2.1)
    ahead = facing_ahead(turned)
    assert heading(ahead.qpos[0, 3:7]) == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(ahead.qpos[0, :2], 0.0, atol=1e-12)
    np.testing.assert_allclose(ahead.qpos, facing_ahead(sway).qpos, atol=1e-9)
    np.testing.assert_allclose(ahead.keypoints_w, facing_ahead(sway).keypoints_w, atol=1e-9)
    np.testing.assert_allclose(ahead.qvel, facing_ahead(sway).qvel, atol=1e-9)
    assert quat_angle(ahead.qpos[5, 3:7], facing_ahead(sway).qpos[5, 3:7]) < 1e-6


@pytest.mark.medium
def test_a_statue_earns_what_a_dancer_earns_by_the_papers_reward(
    robot: Robot, sway: ReferenceMotion
) -> None:
    audits = audit_both_readings(robot, sway, PaperConfig())
    assert set(audits) == {"root", "world"}
    assert audits["root"].of["statue"] > 0.95


@pytest.mark.medium
def test_a_statue_earns_clearly_less_by_our_reward(robot: Robot, sway: ReferenceMotion) -> None:
    found = audit_reward(robot, sway, TrackConfig())
    assert found.perfect == pytest.approx(TrackConfig().reward.perfect, abs=0.01)
    assert found.of["statue"] < 0.85
    assert found.of["flail"] < found.of["statue"]


@pytest.mark.medium
def test_with_curiosity_flailing_pays_more_than_dancing(
    robot: Robot, sway: ReferenceMotion
) -> None:
    assert audit_reward(robot, sway, PaperConfig(curiosity="formula")).of["flail"] > 1.1


@pytest.mark.parametrize("mode", ["paper", "track"])
@pytest.mark.parametrize("setup", ["scratch", "pretrain", "curiosity", "scratch-curiosity"])
def test_a_setup_is_a_difference_in_data(mode: str, setup: str) -> None:
    assert setup in names("setups")
    config = load(TrainConfig, f"setups/{setup}", {"mode": mode})
    assert config.start == ("scratch" if setup.startswith("scratch") else "walker")
    bonus = config.environment
    beta = bonus.curiosity if isinstance(bonus, PaperConfig) else bonus.reward.curiosity
    assert beta == ("formula" if "curiosity" in setup else "off")


def test_paper_mode_learns_with_the_papers_numbers_unless_reported() -> None:
    assert TrainConfig(mode="paper").tqc.learning_rate == 3e-4
    released = load(TrainConfig, None, {"mode": "paper", "tqc": "{preset: released, batch: 64}"})
    assert (released.tqc.actor, released.tqc.batch) == ((512, 512, 512), 64)
    assert TrainConfig().tqc.preset == "dance"


def turned_by(motion: ReferenceMotion, yaw: float) -> ReferenceMotion:
    """Return the motion turned by an angle about the vertical and moved, by scipy."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_euler("z", yaw)
    qpos, qvel = motion.qpos.copy(), motion.qvel.copy()
    qpos[:, :3] = turn.apply(qpos[:, :3]) + [1.0, -2.0, 0.0]
    old = Rotation.from_quat(qpos[:, [4, 5, 6, 3]])
    qpos[:, 3:7] = (turn * old).as_quat()[:, [3, 0, 1, 2]]
    qvel[:, :3] = turn.apply(qvel[:, :3])
    points = np.array([turn.apply(row) for row in motion.keypoints_w]) + [1.0, -2.0, 0.0]
    bodies = np.array([turn.apply(row) for row in motion.body_pos_w]) + [1.0, -2.0, 0.0]
    return dataclasses.replace(motion, qpos=qpos, qvel=qvel, keypoints_w=points, body_pos_w=bodies)
