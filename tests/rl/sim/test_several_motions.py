"""A clip of several motions: each keeps its own length, its own end and its own cycles."""

import dataclasses

import numpy as np
import pytest

from robojackson.errors import BadConfiguration
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import PaperConfig, ResetConfig, TrackConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.modes.reset_states import StartPhases
from robojackson.rl.sim.preview import AHEAD_S, ROOT_NUMBERS, preview_of
from robojackson.rl.sim.reference_clip import STRIDE, Clip
from robojackson.robot.model import Robot

STEPS = 50


@pytest.fixture(scope="module")
def ending(sway: ReferenceMotion) -> ReferenceMotion:
    """Return the first steps of the sway, elsewhere, which do not repeat."""
    cut = {name: getattr(sway, name)[:STEPS] for name in ("qvel", "source_time_s", "contact")}
    qpos, points = np.array(sway.qpos[:STEPS]), np.array(sway.keypoints_w[:STEPS])
    qpos[:, 0] += 3.0
    points[..., 0] += 3.0
    return dataclasses.replace(sway, cyclic=False, qpos=qpos, keypoints_w=points, **cut)


def test_each_motion_is_read_as_if_it_were_alone(
    sway: ReferenceMotion, ending: ReferenceMotion
) -> None:
    clip, steps = Clip([sway, ending, sway]), np.arange(3 * len(sway))
    for place, motion in enumerate((sway, ending, sway)):
        both, alone = clip.at(place * STRIDE + steps), Clip(motion).at(steps)
        for name in ("qpos", "qvel", "points", "moved", "phase"):
            np.testing.assert_array_equal(getattr(both, name), getattr(alone, name))


def test_only_the_motion_that_ends_ends(sway: ReferenceMotion, ending: ReferenceMotion) -> None:
    clip = Clip([sway, ending])
    late = np.array([500, STRIDE + STEPS - 2, STRIDE + STEPS - 1, STRIDE + 500])
    assert clip.ended(late).tolist() == [False, False, True, True]
    assert clip.repeats(late).tolist() == [True, False, False, False]
    assert clip.folded(late).tolist() == [500 % len(sway), *late[1:3], STRIDE + 500 % STEPS]


def test_every_start_has_its_own_row(sway: ReferenceMotion, ending: ReferenceMotion) -> None:
    clip = Clip([ending, sway, ending])
    starts = clip.starts()
    assert len(starts) == len(sway) + 2 * (STEPS - 1)
    np.testing.assert_array_equal(clip.row(starts), np.arange(len(starts)))


def test_starts_are_drawn_where_a_motion_fails(
    sway: ReferenceMotion, ending: ReferenceMotion
) -> None:
    starts = StartPhases(Clip([sway, ending]), 1.0)
    for _ in range(60):
        starts.record(np.arange(len(sway)), np.zeros(len(sway), bool))
        starts.record(STRIDE + np.arange(STEPS - 1), np.ones(STEPS - 1, bool))
    drawn = starts.draw(1000, np.random.default_rng(0))
    assert (drawn >= STRIDE).mean() > 0.9
    assert set(drawn[drawn >= STRIDE] - STRIDE) <= set(range(STEPS - 1))


def test_a_preview_does_not_depend_on_place_and_heading(
    robot: Robot, sway: ReferenceMotion
) -> None:
    turned = np.array(sway.qpos)
    half = np.radians(25.0)
    turn = np.array([np.cos(half), 0.0, 0.0, np.sin(half)])
    w, x, y, z = turned[:, 3:7].T
    turned[:, 3:7] = np.stack([
        turn[0] * w - turn[3] * z, turn[0] * x - turn[3] * y,
        turn[0] * y + turn[3] * x, turn[0] * z + turn[3] * w,
    ], 1)  # fmt: skip
    turned[:, :2] += [4.0, -2.0]
    there = dataclasses.replace(sway, qpos=turned)
    seen = preview_of(sway, robot)
    np.testing.assert_allclose(preview_of(there, robot), seen, atol=1e-6)
    assert seen.shape == (len(sway), len(AHEAD_S) * (ROOT_NUMBERS + robot.model.nq - 7))


def test_a_preview_holds_the_joints_of_the_steps_ahead(robot: Robot, sway: ReferenceMotion) -> None:
    seen = preview_of(sway, robot).reshape(len(sway), len(AHEAD_S), -1)
    for block, seconds in enumerate(AHEAD_S):
        there = np.roll(sway.qpos[:, 7:], -round(seconds / sway.dt), axis=0)
        np.testing.assert_allclose(
            seen[:, block, ROOT_NUMBERS:], there - robot.standing[7:], atol=1e-9
        )


def test_robots_follow_several_motions_at_once(
    robot: Robot, sway: ReferenceMotion, ending: ReferenceMotion
) -> None:
    config = TrackConfig(observation="preview", threads=1, reset=ResetConfig(stand_share=0.0))
    core = TrackingCore(robot, [sway, ending], config, 16, 0)
    core.reset()
    followed = set(core.step_index // STRIDE)
    for _ in range(STEPS):
        result = core.step(np.zeros((16, core.action_size)))
        assert np.isfinite(result.observation).all()
        followed |= set(core.step_index // STRIDE)
        apart = core.sim.qpos[:, 0] - core.clip.at(core.step_index).qpos[:, 0]
        assert np.abs(apart).max() < 1.5, "a robot was compared with another's motion"
    assert followed == {0, 1}


def test_the_paper_follows_one_motion(robot: Robot, sway: ReferenceMotion) -> None:
    with pytest.raises(BadConfiguration, match="several motions need mode=track"):
        TrackingCore(robot, [sway, sway], PaperConfig(), 1, 0)
