"""What a polish is written by: the policy, or the feedback alone where that dances better."""

import dataclasses
import logging
from pathlib import Path

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.evaluation import polish_choice
from robojackson.rl.evaluation.rollouts import Driver, Rollouts, Starts
from robojackson.rl.policy import Policy, load_policy
from robojackson.rl.sim.reference_clip import Clip
from robojackson.robot.model import Robot

CONTROL = ControlConfig()
STARTS = 97


def chosen(
    robot: Robot,
    sway: ReferenceMotion,
    monkeypatch: pytest.MonkeyPatch,
    lost: dict[str, int],
    raised_m: dict[str, float] | None = None,
) -> Policy:
    """Return what is taken where so many of the starts of each driver end with a fall, and every
    other site is so far above the reference's."""
    found = {name: Driver(CONTROL, lambda *_, name=name: np.array(name)) for name in lost}
    count = {id(found[name]): number for name, number in lost.items()}
    raised = {id(found[name]): height for name, height in (raised_m or {}).items()}

    def danced(
        robot: Robot, clip: Clip, driver: Driver, starts: Starts, horizon: np.ndarray, *_: object
    ) -> Rollouts:
        steps, robots = int(horizon.max()), len(starts.step)
        at = clip.at((starts.step[None] + np.arange(1, steps + 1)[:, None]).ravel())
        qpos, points = (a.reshape(steps, robots, *a.shape[1:]) for a in (at.qpos, at.points))
        reached = points.copy()
        reached[:, :, ::2, 2] += raised.get(id(driver), 0.0)
        fell = np.arange(robots) < count[id(driver)]
        return Rollouts(horizon - fell, fell, horizon, qpos, reached, points, qpos, {})

    monkeypatch.setattr(polish_choice, "drivers", lambda *given: found)
    monkeypatch.setattr(polish_choice, "roll_out", danced)
    layers = ((np.ones((3, 2)), np.ones(2)), (np.ones((2, 2)), np.ones(2)))
    policy = Policy(layers, {"control": dataclasses.asdict(CONTROL)})
    return polish_choice.better_of(policy, sway, robot, Clip(sway), 1)


@pytest.mark.medium
def test_a_policy_that_loses_what_the_feedback_holds_is_left_out(
    robot: Robot,
    sway: ReferenceMotion,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    with caplog.at_level(logging.WARNING):
        policy = chosen(robot, sway, monkeypatch, {"trained": 14, "regulator": 10})
    assert not policy.act(np.ones((4, 3))).any()
    held = {"trained": 1 - 14 / STARTS, "feedback": 1 - 10 / STARTS}
    skills = {f"{name}_skill": share for name, share in held.items()}
    assert policy.facts["beside_feedback"] == pytest.approx({**held, **skills})
    assert "holds 90 % of 97 starts with skill 0.90, with the policy 86 % with 0.86" in caplog.text


@pytest.mark.medium
def test_a_motion_that_does_not_move_has_no_skill_and_its_policy_is_read_again(
    robot: Robot, sway: ReferenceMotion, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    rows = np.zeros(len(sway), int)
    still = dataclasses.replace(
        sway, qpos=sway.qpos[rows], qvel=0 * sway.qvel, keypoints_w=sway.keypoints_w[rows]
    )
    policy = chosen(robot, still, monkeypatch, {"trained": 0, "regulator": 0})
    again = load_policy(policy.save(tmp_path / "policy.safetensors"))
    assert again.facts["beside_feedback"] == {"trained": 1.0, "feedback": 1.0}


@pytest.mark.medium
@pytest.mark.parametrize("lost", [5, 4, 0])
def test_a_policy_that_holds_as_many_starts_or_more_is_kept(
    robot: Robot, sway: ReferenceMotion, monkeypatch: pytest.MonkeyPatch, lost: int
) -> None:
    policy = chosen(robot, sway, monkeypatch, {"trained": lost, "regulator": 5})
    assert policy.act(np.ones((1, 3))).all()


@pytest.mark.medium
@pytest.mark.parametrize(("which", "kept"), [("trained", False), ("regulator", True)])
@pytest.mark.parametrize("lost", [4, 5, 6])
def test_where_about_as_many_are_held_the_one_that_follows_more_closely_is_taken(
    robot: Robot,
    sway: ReferenceMotion,
    monkeypatch: pytest.MonkeyPatch,
    which: str,
    kept: bool,
    lost: int,
) -> None:
    count = {"trained": lost, "regulator": 5}
    policy = chosen(robot, sway, monkeypatch, count, {which: 0.02})
    assert policy.act(np.ones((1, 3))).any() == kept


@pytest.mark.medium
def test_a_policy_that_holds_more_is_kept_even_if_it_follows_less_closely(
    robot: Robot, sway: ReferenceMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    policy = chosen(robot, sway, monkeypatch, {"trained": 0, "regulator": 5}, {"trained": 0.05})
    assert policy.act(np.ones((1, 3))).all()


def test_a_policy_without_feedback_is_not_tried(
    robot: Robot, sway: ReferenceMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    policy = chosen(robot, sway, monkeypatch, {"trained": STARTS})
    assert policy.act(np.ones((1, 3))).all()
    assert "beside_feedback" not in policy.facts
