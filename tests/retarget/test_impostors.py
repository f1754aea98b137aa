"""No impostor of the dancer's own targets beats our motion on a headline of the score card."""

from functools import cache

import numpy as np
import pytest

from robojackson.metrics import impostors
from robojackson.metrics.dance_score import velocity_score
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.targets.cycle import human_clip
from robojackson.retarget.targets.keypoint_targets import Targets, targets
from tests.fixtures.robots import human, robot_motion, stock

CLIPS = ("hip_shake", "walk")
SIDED = [name for name in stock().keypoint_names if name.startswith("left_")]
NAMES = tuple(impostors.impostors([(0, 1)], np.random.default_rng(0)))


@cache
def aims(clip: str) -> Targets:
    motion, _ = human_clip(human(clip), 0.015, "auto", 1.0, RetargetConfig().cycle)
    return targets(motion, stock())


def weighted() -> np.ndarray:
    return stock().keypoint_weights > 0


def truth(clip: str) -> np.ndarray:
    return aims(clip).keypoints_w[:, weighted()]


def impostor(clip: str, name: str) -> np.ndarray:
    names = [n for n, used in zip(stock().keypoint_names, weighted(), strict=True) if used]
    sides = [(names.index(n), names.index(n.replace("left", "right"))) for n in SIDED if n in names]
    team = impostors.impostors(sides, np.random.default_rng(0))
    return team[name](truth(clip), 1 / aims(clip).dt)


@pytest.mark.parametrize("clip", CLIPS)
@pytest.mark.parametrize("name", NAMES)
def test_the_velocity_score_of_the_card_ranks_the_real_motion_first(clip: str, name: str):
    ours = robot_motion(clip).scorecard["velocity_score"]
    assert velocity_score(impostor(clip, name), truth(clip)) < ours


@pytest.mark.parametrize("name", NAMES)
def test_the_keypoint_error_does_so_on_a_walk(name: str):
    """On the small hip shake it does not: half of a sway of 30 mm is 15 mm wrong."""
    error = 1e3 * np.linalg.norm(impostor("walk", name) - truth("walk"), axis=-1).mean()
    assert error > robot_motion("walk").scorecard["keypoint_mm"]


@pytest.mark.parametrize("clip", CLIPS)
def test_a_statue_has_no_velocity_score(clip: str):
    assert velocity_score(impostor(clip, "mean_pose"), truth(clip)) == pytest.approx(0.0)
