"""Linear-quadratic feedback: it keeps a robot on its reference, and is computed once."""

import dataclasses
import logging
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion, poses_sha256
from robojackson.rl.config.train_config import ControlConfig, EvaluateConfig, TrackConfig
from robojackson.rl.evaluation.rollouts import Driver, roll_out
from robojackson.rl.evaluation.starts import starts_of
from robojackson.rl.feedback import cached_feedback, regulator, search_log
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.feedback.nominal_path import Gains
from robojackson.rl.modes.track_mode import control_of
from robojackson.rl.policy import Policy
from robojackson.rl.policy_facts import policy_control
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.sim.tangent import state_difference, state_plus
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot
from tests.fixtures.deploy_policies import random_policy

LED = ControlConfig(feedforward=1.0)
FED = dataclasses.replace(LED, feedback=1.0)


@pytest.fixture(autouse=True)
def store(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return one store for all tests of this file: the gains are computed once."""
    folder = tmp_path_factory.getbasetemp() / "feedback_store"
    folder.mkdir(exist_ok=True)
    monkeypatch.setenv("ROBOJACKSON_STORE", str(folder))
    return folder


def survived_s(robot: Robot, motion: ReferenceMotion, control: ControlConfig) -> float:
    clip = driven_clip(robot, motion, control)
    starts, _ = starts_of(robot, clip, EvaluateConfig(phases=8, resets=1))
    horizon = clip.horizon(starts.step, 5.0)
    driver = Driver(control, lambda sim, step, start, last: sim.reference_angles(step))
    done = roll_out(robot, clip, driver, starts, horizon, 1, Fall.of(robot))
    return float(done.length.mean()) * motion.dt


def test_states_are_moved_and_compared_as_mujoco_does(robot: Robot) -> None:
    model, rng = robot.model, np.random.default_rng(0)
    qpos = np.tile(robot.standing, (5, 1))
    change = rng.normal(0, 0.7, (5, 2 * model.nv))
    change[0] = 0.0
    moved, qvel = state_plus(qpos, np.zeros((5, model.nv)), change)
    for row in range(5):
        theirs = qpos[row].copy()
        mujoco.mj_integratePos(model, theirs, change[row, : model.nv], 1.0)
        np.testing.assert_allclose(moved[row], theirs, atol=1e-12)
    back = state_difference(moved, qvel, qpos, np.zeros((5, model.nv)))
    np.testing.assert_allclose(back, change, atol=1e-9)


def test_the_regulator_sees_the_physics_that_the_robot_is_in(
    robot: Robot, sway: ReferenceMotion
) -> None:
    sim = Simulation(robot, LED, 3)
    clip = driven_clip(robot, sway, LED)
    at, following = clip.at(np.array([0, 20, 40])), clip.at(np.array([1, 21, 41]))
    targets = sim.reference_angles(following)
    qpos, qvel = regulator.advance(sim, at.qpos, at.qvel, targets)
    sim.place(np.arange(3), at.qpos, at.qvel)
    sim.step(targets)
    np.testing.assert_allclose(qpos, sim.qpos, atol=1e-4)
    np.testing.assert_allclose(qvel, sim.qvel, atol=2e-2)


def test_feedback_keeps_a_robot_up_that_falls_without_it(
    robot: Robot, sway: ReferenceMotion
) -> None:
    alone, fed = (survived_s(robot, sway, control) for control in (LED, FED))
    assert fed > 1.5 * alone, f"{fed:.2f} s with feedback, {alone:.2f} s without"


def test_on_its_nominal_path_the_feedback_adds_its_offset_alone(
    robot: Robot, sway: ReferenceMotion
) -> None:
    found = cached_feedback.feedback_of(robot, [sway], FED)
    assert found is not None
    row, shift = np.array([3, 50]), np.array([[0.0, 0, 0], [2.0, -1.0, 0]])
    step = found.at(row, shift)
    moved = found.gains.qpos[row] + np.pad(shift, ((0, 0), (0, step.qpos.shape[1] - 3)))
    offset = -np.clip(found.gains.offset[row], -found.limit, found.limit)
    np.testing.assert_allclose(step.targets(moved, found.gains.qvel[row]), offset, atol=1e-9)
    far = moved + 0.0
    far[:, 7:] += 5.0
    assert np.abs(step.targets(far, found.gains.qvel[row])).max() <= found.limit.max() + 1e-12


def test_a_search_without_another_progress_logs_its_length_and_then_what_is_done(
    robot: Robot, sway: ReferenceMotion, monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture, tmp_path: Path,
) -> None:  # fmt: skip
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path))
    monkeypatch.setattr(search_log, "EVERY_S", 0.0)
    with caplog.at_level(logging.INFO):
        cached_feedback.feedback_of(robot, [sway], FED)
    first, *rest = [record.getMessage() for record in caplog.records]
    length = f"{len(sway) * sway.dt:.1f} s of motion"
    assert length in first
    assert rest, "a line for each part"
    assert all(length in line and "s so far" in line for line in rest), rest
    caplog.clear()
    with caplog.at_level(logging.INFO):
        cached_feedback.feedback_of(robot, [sway], FED)
    assert not caplog.records, "what is in the cache needs no line"


def test_the_log_of_a_search_has_a_line_every_fifteen_seconds(
    caplog: pytest.LogCaptureFixture,
) -> None:
    times = iter([0.0, 5.0, 16.0, 20.0, 32.0])
    with caplog.at_level(logging.INFO):
        heard = search_log.SearchLog(12.3, clock=lambda: next(times))
        for step in (1, 2, 3, 4):
            heard("sampled path", step, 4)
    assert [record.getMessage() for record in caplog.records][1:] == [
        "feedback along 12.3 s of motion: sampled path, 50 %, 16 s so far",
        "feedback along 12.3 s of motion: sampled path, 100 %, 32 s so far",
    ]


@pytest.mark.parametrize("name", ["cycle_offset", "qvel"])
def test_motions_of_the_same_poses_that_move_otherwise_have_gains_of_their_own(
    robot: Robot, sway: ReferenceMotion, name: str
) -> None:
    other = dataclasses.replace(sway, **{name: getattr(sway, name) + 0.1})
    assert poses_sha256(other) == poses_sha256(sway)
    paths = {cached_feedback._path(robot, motion, FED) for motion in (sway, other)}
    assert len(paths) == 2
    again = dataclasses.replace(sway, **{name: np.array(getattr(sway, name))})
    assert cached_feedback._path(robot, again, FED) in paths


def test_gains_are_computed_once_and_again_where_the_file_is_damaged(
    robot: Robot, sway: ReferenceMotion, store: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = cached_feedback.feedback_of(robot, [sway], FED)
    calls: list[int] = []
    compute = cached_feedback.regulator_of

    def counted(*given: Any) -> Gains:
        calls.append(1)
        return compute(*given)

    monkeypatch.setattr(cached_feedback, "regulator_of", counted)
    again = cached_feedback.feedback_of(robot, [sway], FED)
    assert cached_feedback.feedback_of(robot, [sway], dataclasses.replace(FED, action_factor=4.0))
    assert not calls, "the range of a policy's actions does not change the feedback"
    here = dataclasses.replace(
        robot.description, file="/a/robot.yaml", mjcf="/a/model.xml", robust_action_factor=3.0
    )
    assert cached_feedback.feedback_of(dataclasses.replace(robot, description=here), [sway], FED)
    assert not calls, "the place of a robot's file does not change the feedback"
    assert kept is not None
    assert again is not None
    for one in dataclasses.fields(Gains):
        computed, read = getattr(kept.gains, one.name), getattr(again.gains, one.name)
        np.testing.assert_array_equal(read, computed, f"{one.name}: not the same to the bit")
    for file in (store / cached_feedback.FOLDER).glob("*.npz"):
        whole = file.read_bytes()
        cuts = (whole[:100], b"", whole[:4000] + bytes(4096) + whole[8096:])
        for count, damaged in enumerate(cuts, 1):
            file.write_bytes(damaged)
            assert cached_feedback.feedback_of(robot, [sway], FED) is not None
            assert len(calls) == count
    del calls[1:]
    for file in (store / cached_feedback.FOLDER).glob("*.npz"):
        np.savez(
            file, gain=np.zeros((2, 2)), offset=np.zeros(3), qpos=np.zeros(1), qvel=np.zeros(1)
        )
    assert cached_feedback.feedback_of(robot, [sway], FED) is not None
    assert calls == [1, 1], "gains of another shape were taken"
    other = dataclasses.replace(sway, qpos=sway.qpos + [0.0, 0, 0, 0, 0, 0, 0, *[1e-3] * 17])
    assert cached_feedback.feedback_of(robot, [other], FED) is not None
    assert calls == [1, 1, 1]


def test_half_a_share_is_half_the_feedback(robot: Robot, sway: ReferenceMotion) -> None:
    whole, half = (
        cached_feedback.feedback_of(robot, [sway], dataclasses.replace(FED, feedback=share))
        for share in (1.0, 0.5)
    )
    assert whole is not None
    assert half is not None
    np.testing.assert_allclose(half.gains.gain, whole.gains.gain / 2, rtol=1e-5, atol=1e-6)
    alone = cached_feedback.feedback_of(robot, [sway], LED)
    assert alone is None, "the humanoid has none by itself"


def test_a_policy_of_many_motions_gets_no_feedback() -> None:
    config = TrackConfig(observation="preview")
    assert control_of(config).feedback == 0.0
    named = dataclasses.replace(config, control=FED)
    assert control_of(named).feedback == 1.0
    assert control_of(TrackConfig()).feedback is None


def test_a_policy_of_a_robots_own_measurements_gets_that_of_an_estimated_root() -> None:
    estimated = ControlConfig(root_state="estimated")
    assert control_of(TrackConfig(observation="onboard")) == estimated
    assert control_of(TrackConfig(observation="onboard", control=FED)).root_state == "estimated"
    exact = dataclasses.replace(FED, root_state="exact")
    assert control_of(TrackConfig(observation="onboard", control=exact)) == exact
    assert control_of(TrackConfig(control=FED)).root_state is None


def test_a_policy_from_before_is_fed_with_the_exact_root(
    robot: Robot, sway: ReferenceMotion
) -> None:
    policy = random_policy(robot, sway)
    law = dataclasses.asdict(FED)
    del law["root_state"]
    old = Policy(policy.layers, {**policy.facts, "control": law})
    sim = Simulation(robot, policy_control(old, robot), 1)
    assert sim.root_estimate is None
    sim.close()


def test_a_policy_from_before_has_none(robot: Robot, sway: ReferenceMotion) -> None:
    policy = random_policy(robot, sway)
    result = policy.facts["control"]
    assert isinstance(result, dict)
    before = {name: value for name, value in result.items() if name != "feedback"}
    old = Policy(policy.layers, {**policy.facts, "control": before})
    assert policy_control(old, robot).feedback == 0.0
