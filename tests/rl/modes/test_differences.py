"""What a policy sees that is to hold for other motions, and the network that its file holds."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import TqcConfig, TrackConfig, TrainConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.modes.differences import ROOT_INPUTS, Differences
from robojackson.rl.modes.observation import Observer
from robojackson.rl.policy import Policy, load_policy
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.tqc.network_arrays import Networks, load_networks
from robojackson.rl.training import train_policy
from robojackson.robot.model import Robot

SMALL = TqcConfig(n_envs=4, warmup=8, batch=8, buffer=1000, actor=(12, 8), critic=(10,))
TRACK = TrackConfig(observation="onboard", differences=True)


def test_another_pose_with_the_same_errors_looks_the_same(
    robot: Robot, sway: ReferenceMotion
) -> None:
    observer, target = Observer(robot, "onboard"), Clip(sway).at(np.array([21]))
    state = sway.qpos[[20]], sway.qvel[[20]], sway.keypoints_w[[20]]
    still = np.zeros((1, robot.model.nu))
    seen = [observer.observe(*state, target, still)]
    qpos, qvel = target.qpos.copy(), target.qvel.copy()
    moved = state[0].copy(), state[1].copy(), state[2]
    for angles, speeds in ((qpos, qvel), moved[:2]):
        angles[:, 7:] += 0.2
        speeds[:, 6:] -= 0.5
    seen.append(observer.observe(*moved, replace(target, qpos=qpos, qvel=qvel), still))
    differences = Differences(
        robot.model.nq - 7, robot.model.nu, observer.size - observer.actor_size
    )
    first, second = (differences.of(each)[:, : differences.size] for each in seen)
    assert np.abs(seen[0] - seen[1])[:, : observer.actor_size].max() > 0.04
    np.testing.assert_allclose(first, second, atol=1e-6)
    apart = target.qpos[0, 7:] - state[0][0, 7:]
    np.testing.assert_allclose(first[0, 9 : 9 + len(apart)], 3 * apart, atol=1e-6)


def test_a_files_network_does_on_the_whole_observation_what_was_learnt_on_the_differences(
    robot: Robot, sway: ReferenceMotion
) -> None:
    core = TrackingCore(robot, sway, TRACK, 4, 0)
    whole = TrackingCore(robot, sway, replace(TRACK, differences=False), 4, 0)
    rng, sizes = np.random.default_rng(3), (core.actor_size, 12, robot.model.nu)
    layers = tuple(
        (rng.normal(0, 0.3, size), rng.normal(0, 0.1, size[1])) for size in pairwise(sizes)
    )
    learnt = Policy(layers, {})
    kept = learnt.with_first(core.mode.of_files)
    assert kept.observation_size == whole.actor_size
    seen, all_of_it = core.reset(), whole.reset()
    assert seen.shape[1] == core.observation_size
    end = core.actor_size + whole.observation_size - whole.actor_size
    np.testing.assert_array_equal(seen[:, core.actor_size : end], all_of_it[:, whole.actor_size :])
    count = 2 * (robot.model.nq - 7)
    begin = ROOT_INPUTS + count
    np.testing.assert_array_equal(seen[:, end:], all_of_it[:, begin : begin + count])
    np.testing.assert_allclose(
        kept.act(all_of_it[:, : whole.actor_size]),
        learnt.act(seen[:, : core.actor_size]),
        atol=1e-5,
    )


def test_a_files_critic_judges_the_whole_observation_as_the_learnt_one_did(
    robot: Robot, sway: ReferenceMotion
) -> None:
    core = TrackingCore(robot, sway, TRACK, 4, 0)
    whole = TrackingCore(robot, sway, replace(TRACK, differences=False), 4, 0)
    rng = np.random.default_rng(5)
    learnt = rng.normal(0, 0.3, (core.observation_size + robot.model.nu, 6))
    action = rng.uniform(-1, 1, (4, robot.model.nu))
    seen, all_of_it = core.reset(), whole.reset()
    kept = core.mode.of_files(learnt)
    assert len(kept) == whole.observation_size + robot.model.nu
    judged = np.concatenate([all_of_it, action], 1) @ kept
    np.testing.assert_allclose(judged, np.concatenate([seen, action], 1) @ learnt, atol=1e-4)


def test_a_files_networks_act_without_what_the_actor_has_not_seen(
    robot: Robot, sway: ReferenceMotion
) -> None:
    """Weights of unseen inputs stay as random as they began."""
    core = TrackingCore(robot, sway, TRACK, 4, 0)
    whole = TrackingCore(robot, sway, replace(TRACK, differences=False), 4, 0)
    learnt = np.random.default_rng(7).normal(0, 0.3, (core.observation_size, 6))
    networks = Networks({"actor.0.weight": learnt}, {}).without_unseen(core.actor_size)
    kept = networks.with_first(core.mode.of_files).tensors["actor.0.weight"]
    seen, all_of_it = (each.reset() for each in (core, whole))
    np.testing.assert_allclose(
        all_of_it @ kept, seen[:, : core.actor_size] @ learnt[: core.actor_size], atol=1e-4
    )


@pytest.mark.medium
@pytest.mark.parametrize("trainer", ["sbx", "sb3"])
def test_such_a_training_writes_a_policy_of_sensors_and_networks_to_start_from(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path, trainer: str
) -> None:
    config = TrainConfig(trainer=trainer, steps=120, tqc=SMALL, track=TRACK)  # type: ignore[arg-type]
    first = train_policy(sway, robot, config, tmp_path / "first")
    policy, networks = load_policy(first.policy), tmp_path / "first" / "networks.safetensors"
    whole = TrackingCore(robot, sway, TrackConfig(observation="onboard"), 1, 0)
    assert policy.observation_size == whole.actor_size
    assert load_networks(networks).observation_size == whole.observation_size
    track = replace(TRACK, differences=False)
    going_on = replace(config, track=track, start=str(networks), steps=8)
    assert train_policy(sway, robot, going_on, tmp_path / "second").steps >= 8


def test_differences_are_of_sensors_and_from_scratch() -> None:
    with pytest.raises(ValidationError, match="differences is for observation onboard"):
        TrackConfig(differences=True)
    with pytest.raises(ValidationError, match=r"track\.differences needs start scratch"):
        TrainConfig(track=TRACK, start="walker")
