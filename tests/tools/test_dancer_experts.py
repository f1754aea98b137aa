"""The dancer's experts: what they advise, how they are kept, and that a network learns from it."""

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
import torch

from robojackson.rl.feedback.feedback_law import Feedback
from robojackson.rl.feedback.nominal_path import Gains
from robojackson.rl.feedback.standing_feet import Feet, Sites
from tests.fixtures.robots import stock
from tests.tools.test_dancer_learning import N, motions, packed
from tools.dancer import experts
from tools.dancer.advice import LEAST_HELD, Experts
from tools.dancer.imitation import Lessons
from tools.dancer.mujoco_robots import MujocoRobots
from tools.dancer.network import Dancer
from tools.dancer.ppo import Trainer
from tools.dancer.rehearsal import Rehearsal
from tools.dancer.repertoire import ACROSS, TURN, Motions

STEP = torch.arange(N) * 7 + 5
FIRST = torch.zeros(N, dtype=torch.long)
"""The motion that ends."""


@lru_cache
def gains() -> Gains:
    """Return a law along a path beside the motion that ends."""
    rng, motion, model = np.random.default_rng(3), motions()["ends"], stock().model
    steps = len(motion)
    qpos = np.array(motion.qpos)
    qpos[:, 7:] += 0.02 * rng.normal(size=model.nv - 6)
    places = Feet(stock()).places(qpos)
    places[steps // 2 :] = np.nan  # from there on the path stays in the world
    return Gains(
        np.tile(0.1 * rng.normal(size=(model.nu, 2 * model.nv)), (steps, 1, 1)),
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
        state = mirrored(*state)
    robots.place(torch.ones(N, dtype=torch.bool), *state)
    return robots


def mirrored(qpos: torch.Tensor, qvel: torch.Tensor, points: torch.Tensor) -> list[torch.Tensor]:
    across, turn = torch.tensor(ACROSS), torch.tensor(TURN)
    partner, sign, point = (
        torch.as_tensor(packed()[name]) for name in ("mirror_hinge", "mirror_sign", "mirror_point")
    )
    hinges, speeds = (one[:, partner] * sign for one in (qpos[:, 7:], qvel[:, 6:]))
    return [
        torch.cat([qpos[:, :3] * across, qpos[:, 3:7] * turn, hinges], 1),
        torch.cat([qvel[:, :3] * across, -qvel[:, 3:6] * across, speeds], 1),
        points[:, point] * across,
    ]


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


def test_an_expert_that_comes_later_is_read_and_a_poor_one_does_not_advise(tmp_path: Path) -> None:
    every = Experts(packed(), Motions(packed(), "cpu"), "cpu")
    assert every.take(tmp_path) == 0
    poor = replace(gains(), held=np.array([LEAST_HELD - 0.1]))
    np.savez_compressed(tmp_path / "ends.npz", **experts._coded(poor))
    assert every.take(tmp_path) == 0
    _, knows = every.advise(robots_beside(FIRST), FIRST, STEP)
    assert not knows.any()


def test_a_network_comes_nearer_to_its_experts_and_then_learns_from_rewards(folder: Path) -> None:
    torch.manual_seed(0)
    rehearsal = Rehearsal(packed(), MujocoRobots(packed(), 8), "cpu", 0, everything=True)
    size, motors = rehearsal.seen.shape[1], rehearsal.action.shape[1]
    assert rehearsal.sight.actor_size == size
    dancer, every = Dancer(size, size, motors, (64,)), Experts(packed(), rehearsal.motions, "cpu")
    trainer = Trainer(dancer, rehearsal, 16, 1e-3, every)
    lessons = Lessons(trainer, every, folder, 1.0, 2.0)
    assert not lessons.plan(0.0)
    deviation = float(dancer.log_deviation.detach()[0])
    distances = [trainer.round()["off"] for _ in range(20)]
    assert distances[-1] < 0.7 * distances[0]
    assert float(dancer.log_deviation.detach()[0]) == deviation  # only rewards change it
    assert lessons.plan(1.0)
    assert not lessons.plan(1.5)
    trainer.round()
    assert trainer.learning
    assert float(dancer.log_deviation.detach()[0]) != deviation
