"""Robots that perform: a run depends on its own seed alone, a lost robot stands and goes on."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.retarget.performance.programme import Part, Programme
from robojackson.rl.config.performance_config import PerformanceConfig
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.evaluation.foresight import ASIDE_M_S, JUMPS_S, Foresight
from robojackson.rl.evaluation.performance import perform
from robojackson.rl.evaluation.performance_record import Performance
from robojackson.rl.evaluation.performers import Moment, Performers, Stage
from robojackson.rl.sim.motors import Motors
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.trackers.tracker import TrackerInput
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot
from tests.fixtures.robots import robot_motion

STEPS, DT = 60, 0.015
CONFIG = PerformanceConfig(threads=1, calm_s=0.03)


class Replay:
    """A tracker that gives the next step's angles."""

    window: tuple[int, ...] = (1,)
    control = ControlConfig(feedforward=0.0, feedback=0.0)
    sees_ahead, sees_travel = False, True
    description = TrackerDescription(
        name="replay", robot="humanoid", network="regulator", licence="ours",
        trained_on="nothing", homepage="http://127.0.0.1:9/", control_dt=0.015,
    )  # fmt: skip

    def equip(self, robot: Robot) -> Robot:
        return robot

    def follow(self, robot: Robot, n: int) -> "Replay":
        self._hinge = Motors.of(robot.model).hinge
        return self

    def targets(self, seen: TrackerInput) -> np.ndarray:
        return seen.window[0].qpos[:, 7:][:, self._hinge]


def programme() -> Programme:
    """Return three parts of the hip-shake's beginning, the middle one a dance."""
    motion = robot_motion("hip_shake")
    rows = {
        name: np.asarray(getattr(motion, name))[:STEPS]
        for name in ("qpos", "qvel", "body_pos_w", "keypoints_w", "contact", "torque_ratio",
                     "source_time_s")
    }  # fmt: skip
    short: ReferenceMotion = replace(motion, cyclic=False, certificate=None, **rows)
    bounds = ((0, 20, "stand"), (20, 40, "dance"), (40, STEPS, "stand"))
    parts = tuple(
        Part(name, a, b, (a, b) if name == "dance" else (a, a), 0.0) for a, b, name in bounds
    )
    return Programme(short, parts)


def qpos_of(tilt: float) -> np.ndarray:
    """Return one robot, turned about its left axis."""
    return np.array([[0.0, 0.0, 1.2, np.cos(tilt / 2), 0.0, np.sin(tilt / 2), 0.0]])


@pytest.mark.medium
def test_a_run_is_that_of_its_seed_whoever_runs_beside_it(robot: Robot) -> None:
    whole_s = STEPS * DT  # no need to look ahead beyond the programme's end
    pushed = replace(CONFIG, runs=2, seed=6, pushes=4.0, ahead_s=whole_s)
    together = perform(Replay(), programme(), robot, pushed)
    alone = perform(Replay(), programme(), robot, replace(pushed, runs=1, seed=7))
    rows = int(alone.length[0])
    assert together.length[1] == rows
    np.testing.assert_array_equal(together.qpos[:rows, 1], alone.qpos[:rows, 0])


@pytest.mark.medium
def test_a_robot_that_gave_up_and_stands_is_looked_after(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A push while it waited made it fall, because its fall was not foreseen."""
    looked = []

    def choose(self: Foresight, robots: Performers, doubted: np.ndarray, passed: int) -> None:
        looked.append((bool(robots.stage.waits[0]), bool(doubted[0])))
        robots.stage.give_up(np.ones(1, bool))

    monkeypatch.setattr(Foresight, "choose", choose)
    perform(Replay(), programme(), robot, replace(CONFIG, runs=1, pushes=0.0, calm_rad=1e-6))
    assert (True, True) in looked


@pytest.mark.medium
def test_who_is_not_pushed_and_does_not_fall_finishes_and_has_danced_all(robot: Robot) -> None:
    certain = replace(CONFIG, runs=1, pushes=0.0, doubt_rad=0.5)
    done = perform(Replay(), programme(), robot, certain)
    (row,) = done.runs(0)
    assert (row["finished"], row["fell_in"], row["given_up"]) == (True, "", "")
    assert row["danced_share"] == 1.0
    assert [part["whole"] for part in done.parts()] == [1, 1, 1]
    assert 0.0 < float(row["mpjpe_l_m"]) < 0.1  # type: ignore[arg-type]


@pytest.mark.medium
def test_what_is_shown_of_a_run_ends_with_its_fall(robot: Robot) -> None:
    class Limp(Replay):
        def targets(self, seen: TrackerInput) -> np.ndarray:
            return 0.0 * super().targets(seen) + 1.0

    certain = replace(CONFIG, runs=1, pushes=0.0, doubt_rad=3.0)  # nothing is looked ahead
    done = perform(Limp(), programme(), robot, certain)
    last = done.recorded(0) - 1
    target = np.asarray(programme().motion.qpos)
    fallen = [
        bool(Fall.of(robot).has_fallen(done.qpos[row], target[done.step[row]])[0])
        for row in (last - 1, last)
    ]
    assert (bool(done.fell[0]), fallen) == (True, [False, True])


def test_a_run_that_stands_to_its_end_is_shown_whole(robot: Robot) -> None:
    steps = np.zeros((7, 1), int)
    states = np.zeros((7, 1, robot.model.nq))
    points = np.zeros((7, 1, len(robot.keypoint_names), 3))
    record = (steps, steps > 0, states, points, states[..., :3], np.zeros(1, int), ((),))
    for fell in (False, True):  # one that never came to rest fell, too
        done = Performance(programme(), np.array([7]), np.array([fell]), *record)
        assert done.recorded(0) == 7


def test_a_step_that_is_danced_twice_counts_once(robot: Robot) -> None:
    """A robot that went back half a second had danced more than all of the dance."""
    plan = programme()
    step = np.concatenate([np.arange(30), np.arange(25, 35), np.arange(40, STEPS)])
    count = len(step)
    states = np.asarray(plan.motion.qpos)[step][:, None]
    points = np.asarray(plan.motion.keypoints_w)[step][:, None]
    done = Performance(
        plan, np.array([count]), np.zeros(1, bool), step[:, None], np.zeros((count, 1), bool),
        states, points, states[..., :3], np.zeros(1, int), ((),),
    )  # fmt: skip
    (row,) = done.runs(0)
    assert row["danced_share"] == 15 / 20


def test_a_robot_that_gives_up_waits_and_goes_on_when_it_is_calm() -> None:
    stage = Stage(1, CONFIG, programme())
    for _ in range(25):
        stage.advance()
    stage.give_up(np.ones(1, bool))
    assert (bool(stage.waits[0]), int(stage.step[0])) == (True, 39)
    assert stage.given_up == [["dance"]]
    stage.advance()
    stage.rest(np.array([0.6]))
    assert (bool(stage.waits[0]), int(stage.step[0])) == (True, 39)
    for _ in range(2):
        stage.advance()
        stage.rest(np.zeros(1))
    assert not stage.waits[0]
    stage.advance()
    assert stage.step[0] == 40


def test_what_a_twin_does_does_not_happen_to_the_robot() -> None:
    stage = Stage(2, CONFIG, programme())
    twin = stage.copied()
    twin.give_up(np.ones(2, bool))
    twin.advance()
    assert not stage.waits.any()
    assert stage.given_up == [[], []]
    np.testing.assert_array_equal(stage.step, [0, 0])


class Twins:
    """Robots whose twins fall after so many steps, a row for each choice: to go on, each of the
    jumps, to step aside, to give up, to give up and step aside."""

    def __init__(self, falls: np.ndarray) -> None:
        self.falls, self.now, self.copies = falls, 0, list[list[bool]]()
        self.sim = SimpleNamespace(qvel=np.zeros((falls.shape[1], 6)))
        self.stage = Stage(falls.shape[1], CONFIG, programme())
        for _ in range(25):
            self.stage.advance()

    def copied(self, sim: object, rows: np.ndarray) -> "Twins":
        self.copies.append(rows.tolist())
        twin = Twins(self.falls)
        twin.stage = self.stage.copied()
        return twin

    def step(self, up: np.ndarray) -> Moment:
        self.now += 1
        jumps = [round(seconds / DT) for seconds in JUMPS_S]
        reached = np.clip(25 + np.array(jumps), 20, 39)
        waits, aside = self.stage.waits, self.stage.aside[:, 1] > 0.99 * ASIDE_M_S
        other = np.where(self.stage.aside.any(1) & ~aside, 99, 0)
        choice = np.where(waits, 6 + aside, 5 * aside)
        for number, step in enumerate(reached):
            choice[~waits & ~aside & (self.stage.step == step)] = 1 + number
        down = self.now + other > self.falls[choice, np.arange(len(up))]
        return Moment(np.zeros((len(up), 7)), np.zeros((len(up), 1, 3)), np.zeros(len(up)), down)


def test_a_robot_that_would_fall_does_what_keeps_it_up_longest(robot: Robot) -> None:
    never = 99
    falls = np.array([
        [never, 4, 4, 4, 4, 4, 4, 4],
        *[[never, never, 3, 3, 4, never, 3, 3]] * len(JUMPS_S),
        [never, never, 3, 3, 4, never, never, 3],
        [never, never, never, 6, 4, never, never, 5],
        [never, never, never, 3, 4, never, never, never],
    ])  # fmt: skip
    foresight = Foresight(robot, Replay(), replace(CONFIG, runs=8, ahead_s=0.15))
    twins = Twins(falls)
    doubted = np.array([True] * 5 + [False] + [True] * 2)
    foresight.choose(twins, doubted)  # type: ignore[arg-type]
    foresight.close()
    stage = twins.stage
    assert stage.step.tolist() == [25, 25 + round(JUMPS_S[0] / DT), 39, 39, 25, 25, 25, 39]
    assert stage.waits.tolist() == [False, False, True, True, False, False, False, True]
    given_up = [number for number, parts in enumerate(stage.given_up) if parts == ["dance"]]
    assert given_up == [2, 3, 7]
    np.testing.assert_allclose(stage.aside[6:], [[0.0, ASIDE_M_S]] * 2, atol=1e-9)
    assert not stage.aside[:6].any()


def test_a_tracker_that_does_not_see_the_velocity_is_not_asked_to_step_aside(robot: Robot) -> None:
    class Blind(Replay):
        sees_travel = False

    twins = Twins(np.full((8, 1), 4))
    foresight = Foresight(robot, Blind(), replace(CONFIG, runs=1, ahead_s=0.3))
    foresight.choose(twins, np.ones(1, bool))  # type: ignore[arg-type]
    foresight.close()
    assert len(twins.copies) == 2 + len(JUMPS_S)


def test_a_robot_that_moves_as_foreseen_is_not_simulated_again_for_a_while(robot: Robot) -> None:
    foresight = Foresight(robot, Replay(), replace(CONFIG, runs=3, ahead_s=0.3))
    falls = np.full((8, 3), 99)
    falls[:, 2] = 4
    twins, doubted = Twins(falls), np.ones(3, bool)
    foresight.choose(twins, doubted)  # type: ignore[arg-type]
    assert twins.copies[0] == [True] * 3
    first = len(twins.copies)
    twins.sim.qvel[1, 0] = 0.2
    foresight.choose(twins, doubted, 4)  # type: ignore[arg-type]
    assert twins.copies[first] == [False, True, True]
    twins.sim.qvel[:] = 0.0
    second = len(twins.copies)
    foresight.choose(twins, doubted, 7)  # type: ignore[arg-type]
    foresight.close()
    assert twins.copies[second] == [True, False, True]


def test_a_robot_that_steps_aside_sees_another_velocity_for_a_while() -> None:
    stage, clip = Stage(2, CONFIG, programme()), Clip(programme().motion)
    stage.step_aside(np.array([True, False]), np.array([0.0, 1.0]), 2)
    before, poses = clip.at(stage.ahead(1)).qvel.copy(), clip.at(stage.ahead(1)).qpos.copy()
    moved = stage.seen(clip, 1)
    np.testing.assert_allclose(moved.qvel[:, :2] - before[:, :2], [[0.0, 1.0], [0.0, 0.0]])
    np.testing.assert_array_equal(moved.qvel[:, 2:], before[:, 2:])
    np.testing.assert_array_equal(moved.qpos, poses)
    for _ in range(2):
        stage.advance()
    assert not stage.aside.any()


def test_a_robot_that_jumps_goes_on_from_where_it_is() -> None:
    stage = Stage(1, CONFIG, programme())
    for _ in range(25):
        stage.advance()
    stage.jump(np.ones(1, bool), 99)
    assert stage.step[0] == 39
    near, now = qpos_of(0.0), qpos_of(0.0)
    near[0, 0] = 0.1
    stage.place(near, now)
    np.testing.assert_allclose(stage.placed.qpos(now)[:, :2], near[:, :2])
    assert stage.carried[0] == 0


def test_the_programme_is_put_under_a_robot_that_was_carried_off() -> None:
    stage = Stage(1, CONFIG, programme())
    for _ in range(25):
        stage.advance()
    near, far, now = qpos_of(0.0), qpos_of(0.0), qpos_of(0.0)
    near[0, 0], far[0, :2] = 0.1, (0.3, 0.4)
    stage.place(near, now)
    np.testing.assert_array_equal(stage.placed.shift, [[0.0, 0.0]])
    stage.place(far, now)
    np.testing.assert_allclose(stage.placed.qpos(now)[:, :2], far[:, :2])
    assert stage.carried[0] == 1
