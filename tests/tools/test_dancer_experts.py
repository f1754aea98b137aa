"""The dancer's experts: what they advise, how they are kept, and that a network learns from it."""

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from robojackson.rl.feedback.feedback_law import Feedback
from robojackson.rl.feedback.nominal_path import Gains
from robojackson.rl.feedback.standing_feet import Feet, Sites
from tests.fixtures.robots import stock
from tests.tools.test_dancer_learning import Guess, N, motions, packed
from tools.dancer import experts
from tools.dancer.expert_advice import Experts
from tools.dancer.imitation import Lessons
from tools.dancer.mujoco_robots import MujocoRobots
from tools.dancer.network import Dancer
from tools.dancer.ppo import Trainer
from tools.dancer.repertoire import Mirror, Motions

STEP = torch.arange(N) * 7 + 5
FIRST = torch.zeros(N, dtype=torch.long)
"""The motion that ends."""


@lru_cache
def gains() -> Gains:
    """Return a law along a path beside the motion that ends."""
    rng, motion, model = np.random.default_rng(3), motions()["ends"], stock().model
    steps, weight = len(motion), np.repeat([1.0, 10.0], model.nv)
    qpos = np.array(motion.qpos)
    qpos[:, 7:] += 0.02 * rng.normal(size=model.nv - 6)
    places = Feet(stock()).places(qpos)
    places[steps // 2 :] = np.nan  # from there on the path stays in the world
    return Gains(
        np.tile(0.4 * rng.normal(size=(model.nu, 2 * model.nv)) / weight, (steps, 1, 1)),
        np.tile(0.02 * rng.normal(size=model.nu), (steps, 1)),
        qpos,
        np.array(motion.qvel),
        places,
        np.array([0.9]),
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with the file of the motion that ends."""
    np.savez_compressed(tmp_path / "ends.npz", **experts._coded(gains()))
    return tmp_path


def robots_beside(motion: torch.Tensor) -> MujocoRobots:
    """Return robots a little off the motion, or its mirror image, and not where it is."""
    rng, every, robots = (
        np.random.default_rng(4),
        Motions(packed(), "cpu"),
        MujocoRobots(packed(), N),
    )
    at = every.at(FIRST, STEP)
    qpos = at.qpos.numpy() + 0.02 * rng.normal(size=at.qpos.shape)
    qpos[:, :2] += 0.3
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    qvel = at.qvel.numpy() + 0.1 * rng.normal(size=at.qvel.shape)
    points = Sites(stock(), stock().keypoint_sites).at(qpos)
    state = [torch.tensor(x, dtype=torch.float32) for x in (qpos, qvel, points)]
    if int(motion[0]) % 2:
        mirror = Mirror(packed(), "cpu")
        state = [mirror.qpos(state[0]), mirror.qvel(state[1]), mirror.points(state[2])]
    robots.place(torch.ones(N, dtype=torch.bool), *state)
    return robots


def test_experts_advise_what_the_law_of_control_does(folder: Path) -> None:
    every = Experts(packed(), Motions(packed(), "cpu"), "cpu")
    assert every.take(folder) == 1
    robots = robots_beside(FIRST)
    advice, knows = every.advise(robots, FIRST, STEP)
    law = Feedback(gains(), np.full(stock().model.nu, np.inf), Feet(stock()))
    step = law.at(STEP.numpy(), np.zeros((N, 3)))
    moved = step.targets(robots.qpos.numpy().astype(float), robots.qvel.numpy().astype(float))
    expected = np.clip(moved / packed()["scale"], -1, 1)
    assert knows.all()
    assert 0.02 < np.abs(expected).mean() < 0.9
    np.testing.assert_allclose(advice.numpy(), expected, atol=2e-3)


def test_the_advice_for_a_mirror_image_is_the_mirrored_advice(folder: Path) -> None:
    every = Experts(packed(), Motions(packed(), "cpu"), "cpu")
    every.take(folder)
    own, _ = every.advise(robots_beside(FIRST), FIRST, STEP)
    image, _ = every.advise(robots_beside(FIRST + 1), FIRST + 1, STEP)
    hinge, partner, sign = (
        torch.as_tensor(packed()[name]) for name in ("hinge", "mirror_hinge", "mirror_sign")
    )
    motor = torch.argsort(hinge)[partner[hinge]]
    np.testing.assert_allclose(image.numpy(), (own[:, motor] * sign[hinge]).numpy(), atol=1e-4)


def test_an_expert_that_comes_later_is_read_and_a_robot_far_away_gets_no_advice(
    tmp_path: Path, folder: Path
) -> None:
    every, robots = Experts(packed(), Motions(packed(), "cpu"), "cpu"), robots_beside(FIRST)
    assert every.take(tmp_path / "none") == 0
    assert not every.advise(robots, FIRST, STEP)[1].any()
    assert every.take(folder) == 1
    robots.qvel[0] += 50.0
    knows = every.advise(robots, FIRST, STEP)[1]
    assert knows.tolist() == [False] + [True] * (N - 1)


class Advised(Guess):
    """Robots whose experts know the rewarded actions; what they see stays the same."""

    def advice(self, experts: Experts) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the rewarded actions; every second robot has an expert."""
        return torch.tanh(self.seen[:, :2]), torch.arange(self.n) % 2 == 0


def test_a_network_comes_nearer_to_its_experts_and_then_learns_from_rewards(folder: Path) -> None:
    torch.manual_seed(0)
    every = Experts(packed(), Motions(packed(), "cpu"), "cpu")
    robots: Any = Advised(64)
    dancer = Dancer(3, 4, 2, (32, 32))
    trainer = Trainer(dancer, robots, 4, 1e-3, every)
    lessons = Lessons(trainer, every, folder, 1.0, 2.0)
    assert not lessons.plan(0.0)
    deviation = dancer.log_deviation.detach().clone()
    distances = [trainer.round()["off"] for _ in range(20)]
    assert distances[-1] < 0.2 * distances[0]
    assert torch.equal(dancer.log_deviation, deviation)  # only rewards change it
    assert lessons.plan(1.0)
    assert not lessons.plan(1.5)
    trainer.round()
    assert trainer.learning
    assert not torch.equal(dancer.log_deviation, deviation)


def test_experts_lead_some_robots_at_first(folder: Path) -> None:
    torch.manual_seed(0)
    every = Experts(packed(), Motions(packed(), "cpu"), "cpu")
    robots: Any = Advised(64)
    led, alone = (Trainer(Dancer(3, 4, 2, (32, 32)), robots, 4, 1e-3, every) for _ in range(2))
    led.lead(1.0)
    for trainer in (led, alone):
        trainer.dancer.log_deviation.data.fill_(-5.0)
    assert led.round()["reward"] > 0.6 * alone.round()["reward"]  # both negative
