"""The dancer's learning: torch twins of the environment, its networks, and that it improves."""

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import torch

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.modes.observation import AHEAD, Kind, Observer
from robojackson.rl.policy import load_policy
from robojackson.rl.sim.reference_clip import STRIDE, Clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.robot.fall import Fall
from tests.fixtures.robots import robot_motion, stock
from tools.dancer import learn, pack, ppo, ship
from tools.dancer.mujoco_robots import MujocoRobots
from tools.dancer.network import Dancer, restore, save
from tools.dancer.rehearsal import MOST_RATE, Outcome, Rehearsal
from tools.dancer.rehearsal_reward import LOST_HEIGHT_M, LOST_TILT, REWARD_SCALE, Scoring
from tools.dancer.repertoire import Motions
from tools.dancer.sight import Sight

N = 6
MOTION = torch.arange(N) % 2 * 2
"""Motions of the robots; the odd ones are mirror images."""


@lru_cache
def motions() -> dict[str, ReferenceMotion]:
    """Return one motion that ends and one that is cyclic."""
    return {"ends": robot_motion("dance_b"), "turns": robot_motion("walk", cyclic="yes")}


@lru_cache
def packed() -> dict[str, np.ndarray]:
    """Return the pack of both motions."""
    return pack.pack(stock(), motions())


@lru_cache
def clip() -> Clip:
    """Return both motions as the environment reads them."""
    return driven_clip(stock(), list(motions().values()), pack.CONTROL, ahead=True)


def rehearsal(n: int = N) -> Rehearsal:
    """Return robots of MuJoCo that rehearse."""
    return Rehearsal(packed(), MujocoRobots(packed(), n), "cpu", 0)


def steps() -> torch.Tensor:
    """Return steps of the robots' motions: in the middle, at the end, beyond it."""
    length = torch.tensor([len(motion) for motion in motions().values()])[MOTION // 2]
    middle, end, beyond = length // 2, length - 1, length + 4
    return torch.cat([middle[:2], end[2:4], beyond[4:]])


def test_references_are_those_of_the_environment() -> None:
    mine = Motions(packed(), "cpu").at(MOTION, steps())
    own = clip().at((MOTION // 2 * STRIDE + steps()).numpy())
    for name in ("qpos", "qvel", "points", "moved", "lead", "preview", "phase"):
        expected, scale = getattr(own, name), 1 + np.abs(getattr(own, name))
        assert np.max(np.abs(getattr(mine, name).numpy() - expected) / scale) < 2e-3, name


def test_a_mirror_image_is_a_motion_of_the_same_robot() -> None:
    robot, every = stock(), Motions(packed(), "cpu")
    data = mujoco.MjData(robot.model)
    first, length = int(every.first[1]), int(every.length[1])
    for row in range(first, first + length, 20):
        data.qpos[:] = every.qpos[row].numpy()
        mujoco.mj_kinematics(robot.model, data)
        np.testing.assert_allclose(
            data.site_xpos[robot.keypoint_sites], every.points[row].numpy(), atol=2e-3
        )
    own, image = (every.qvel[int(every.first[m]) :][:length] for m in (0, 1))
    np.testing.assert_allclose(image[:, :3] * torch.tensor([1.0, -1.0, 1.0]), own[:, :3])
    np.testing.assert_allclose(image[:, 5], -own[:, 5])


def test_a_mirrored_lead_holds_the_mirror_image() -> None:
    every, robots = Motions(packed(), "cpu"), MujocoRobots(packed(), 2)
    hinge = torch.as_tensor(packed()["hinge"])
    motion, step = torch.tensor([0, 1]), torch.tensor([20, 20])
    at = every.at(motion, step)
    robots.place(torch.ones(2, dtype=torch.bool), at.qpos, at.qvel, at.points)
    following = every.at(motion, step + 1)
    robots.targets.copy_(following.qpos[:, 7:][:, hinge] + following.lead)
    robots.step()
    np.testing.assert_allclose(robots.qpos[0, 2], robots.qpos[1, 2], atol=2e-4)
    np.testing.assert_allclose(robots.qpos[0, 1], -robots.qpos[1, 1], atol=2e-4)


def test_robots_move_as_those_of_the_environment() -> None:
    robots = MujocoRobots(packed(), N)
    light = replace(
        stock(), model=pack.light_model(stock()), keypoint_sites=packed()["sites"].astype(int)
    )
    sim = Simulation(light, pack.CONTROL, N)
    start = clip().at((MOTION // 2 * STRIDE + steps() // 2).numpy())
    everyone = torch.ones(N, dtype=torch.bool)
    robots.place(everyone, *(torch.tensor(x, dtype=torch.float32)
                             for x in (start.qpos, start.qvel, start.points)))  # fmt: skip
    sim.place(np.arange(N), robots.qpos.numpy().astype(float), robots.qvel.numpy().astype(float))
    for k in range(3):
        targets = clip().at((MOTION // 2 * STRIDE + steps() // 2 + k + 1).numpy())
        angles = sim.reference_angles(targets)
        robots.targets.copy_(torch.as_tensor(angles))
        robots.step()
        sim.step(angles)
    np.testing.assert_allclose(robots.qpos.numpy(), sim.qpos, atol=2e-4)
    np.testing.assert_allclose(robots.points.numpy(), sim.points, atol=2e-4)


@pytest.mark.parametrize("kind", AHEAD)
def test_observations_are_those_of_the_environment(kind: Kind) -> None:
    rng = np.random.default_rng(7)
    robot, robots = stock(), MujocoRobots(packed(), N)
    at = clip().at((MOTION // 2 * STRIDE + steps() // 2).numpy())
    qpos = at.qpos + 0.05 * rng.normal(size=at.qpos.shape)
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    qvel, action = at.qvel + rng.normal(size=at.qvel.shape), rng.uniform(-1, 1, (N, robot.model.nu))
    points = at.points + 0.02 * rng.normal(size=at.points.shape)
    robots.place(torch.ones(N, dtype=torch.bool), *(torch.tensor(x, dtype=torch.float32)
                                                   for x in (qpos, qvel, points)))  # fmt: skip
    observer, every = Observer(robot, kind), Motions(packed(), "cpu")
    everything = kind == "full_preview"
    sight = Sight(packed(), every.preview.shape[1], torch.Generator(), everything)
    sight.noise.zero_()
    mine = sight.observe(robots, every.at(MOTION, steps() // 2), torch.tensor(action).float())
    own = observer.observe(qpos, qvel, points, at, action)
    assert sight.actor_size == observer.actor_size
    if everything:  # all but the phase, by which one would know the motion
        hidden = own.shape[1] - 3 * len(robot.keypoint_names) - 8 + np.arange(2)
        assert np.ptp(own[:, hidden], axis=0).min() > 0.1
        own[:, hidden] = [0.0, 1.0]
    np.testing.assert_allclose(mine.numpy(), own, atol=5e-3)


def test_a_perfect_step_earns_all_and_a_fallen_robot_is_lost() -> None:
    robots, every = MujocoRobots(packed(), N), Motions(packed(), "cpu")
    at = every.at(MOTION, steps() // 2)
    everyone = torch.ones(N, dtype=torch.bool)
    robots.place(everyone, at.qpos, at.qvel, at.points)
    scoring, still = Scoring(packed(), "cpu"), torch.zeros(N)
    reward, lost = scoring.judge(robots, at, at.moved, still)
    assert torch.all(reward > 0.99 * REWARD_SCALE)
    assert not lost.any()
    low = at.qpos.clone()
    low[::2, 2] -= 1.1 * LOST_HEIGHT_M
    robots.place(everyone, low, at.qvel, at.points)
    worse, lost = scoring.judge(robots, at, at.moved, still)
    fallen = Fall(True, LOST_HEIGHT_M, LOST_TILT).has_fallen(low.numpy(), at.qpos.numpy())
    assert lost.tolist() == fallen.tolist() == [True, False] * (N // 2)
    assert torch.all(worse[::2] < reward[::2])


def test_a_robot_that_reaches_the_end_is_not_lost() -> None:
    robots = rehearsal()
    rows = robots.motions.first[MOTION] + robots.motions.length[MOTION] - 2
    robots.calm(rows)
    outcome = robots.step(torch.zeros_like(robots.action))
    assert (outcome.over | outcome.lost)[MOTION == 0].all()
    assert not outcome.over[MOTION == 2].any(), "a cyclic motion has no end"


def test_robots_begin_where_others_are_lost() -> None:
    robots = rehearsal(256)
    robots.loss_rate.fill_(1e-4)
    robots.loss_rate[2] = 1.0
    rows = robots._drawn()
    weak = (rows <= torch.nonzero(robots._bin == 2).max()) & (robots.motions.motion[rows] == 0)
    assert 0.4 < weak.float().mean() < 0.8


def test_a_place_that_no_robot_passes_takes_no_more_starts_than_a_hard_one() -> None:
    robots = rehearsal(2048)
    robots.loss_rate.fill_(1e-4)
    robots.loss_rate[2], robots.loss_rate[6] = MOST_RATE, 1.0
    chosen = robots._chosen(robots.loss_rate.clamp(max=MOST_RATE))
    hard, hopeless = (int((chosen == one).sum()) for one in (2, 6))
    assert 0.8 < hopeless / hard < 1.25
    assert hard + hopeless > 0.8 * len(chosen)


def test_choices_follow_their_weights_and_none_has_no_weight() -> None:
    robots = rehearsal(4096)
    chosen = robots._chosen(torch.tensor([0.0, 3.0, 0.0, 1.0, 0.0]))
    shares = torch.bincount(chosen, minlength=5) / len(chosen)
    np.testing.assert_allclose(shares, [0, 0.75, 0, 0.25, 0], atol=0.03)


def test_a_calm_rehearsal_has_no_noise_and_no_pushes() -> None:
    robots = rehearsal()
    robots.calm(robots.motions.first[MOTION] + 10)
    robots._push_at.zero_()
    before = robots.robots.qvel.clone()
    robots._push_some()
    np.testing.assert_array_equal(robots.robots.qvel, before)
    np.testing.assert_array_equal(robots._observe(), robots._observe())


class Guess:
    """A rehearsal whose reward is the nearness of the action to what is seen."""

    def __init__(self, n: int) -> None:
        self.n, self._random = n, torch.Generator().manual_seed(0)
        self.seen = self._drawn()

    def _drawn(self) -> torch.Tensor:
        return 0.5 * torch.randn(self.n, 4, generator=self._random)

    def step(self, action: torch.Tensor) -> Outcome:
        """Return the reward; every episode has one step."""
        reward = -(action - torch.tanh(self.seen[:, :2])).square().sum(1)
        self.seen = self._drawn()
        ended = torch.ones(self.n, dtype=torch.bool)
        return Outcome(reward, ended, ~ended)


def test_the_trainer_learns_what_is_rewarded() -> None:
    torch.manual_seed(0)
    guess: Any = Guess(256)
    trainer = ppo.Trainer(Dancer(3, 4, 2, (32, 32)), guess, 8, 1e-3)
    first = trainer.round()["reward"]
    for _ in range(40):
        last = trainer.round()["reward"]
    assert last > 0.3 * first, "the loss of reward has not fallen to a third"


def test_no_value_crosses_the_end_of_an_episode() -> None:
    none = torch.zeros(2, 1)
    reward, value = torch.tensor([[1.0], [2.0]]), torch.tensor([[0.5], [0.25]])
    ended = torch.tensor([[True], [False]])
    done = ppo.Round(
        none, none, reward, ended, value, none, none, none, none, torch.tensor([4.0]), 0.0, 0.0
    )
    advantage = ppo.advantages(done)
    late = 2.0 + ppo.GAMMA * 4.0 - 0.25
    np.testing.assert_allclose(advantage[:, 0], [1.0 - 0.5, late], rtol=1e-6)


@pytest.mark.medium
def test_the_tracker_acts_as_the_dancer_that_was_taught(tmp_path: Path) -> None:
    np.savez(tmp_path / "pack.npz", **packed())  # type: ignore[arg-type]
    robots = rehearsal(4)
    dancer = Dancer(robots.sight.actor_size, robots.seen.shape[1], robots.action.shape[1])
    trainer = ppo.Trainer(dancer, robots, 4, 1e-3)
    average = learn.averaged(dancer)
    count = learn.learn(trainer, average, None, tmp_path, 0.5, 100)
    again = Dancer(robots.sight.actor_size, robots.seen.shape[1], robots.action.shape[1])
    assert restore(again, tmp_path / "dancer.npz") == count > 100
    policy = ship.policy_of(tmp_path / "dancer.npz", stock(), "preview", 0, 2)
    held = load_policy(policy.save(tmp_path / "dancer.safetensors"))
    with torch.no_grad():
        expected = again.act(again.scale(robots.seen)).numpy()
    seen = robots.seen[:, : robots.sight.actor_size].numpy()
    np.testing.assert_allclose(held.act(seen), expected, atol=1e-4)
    restore(again, tmp_path / "average.npz")
    for name, value in again.state_dict().items():
        np.testing.assert_allclose(value, average.module.state_dict()[name], rtol=1e-3, atol=1e-3)
    assert int(average.n_averaged) == (count - 100) / trainer.round_steps
    save(again, tmp_path / "dancer.npz", 7)
    assert restore(again, tmp_path / "dancer.npz") == 7
    assert (tmp_path / "curve.csv").read_text().startswith("seconds,steps,reward")
