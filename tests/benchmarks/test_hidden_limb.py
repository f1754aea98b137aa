"""Laws of the benchmark of hidden limbs: which cases it draws, what it hides, what it measures."""

import numpy as np
import pytest

from benchmarks.mocap.hidden_limb import Case, bridged, draw_cases, hide, limb_error
from benchmarks.mocap.truth import JOINTS, Truth
from robojackson.mocap.landmarks.blazepose import landmark
from robojackson.motion.landmark_track import LandmarkTrack

CASE = Case("clip", "left", "arm", 5, 12)


@pytest.fixture
def track() -> LandmarkTrack:
    rng = np.random.default_rng(1)
    marks, world = rng.uniform(size=(20, 33, 3)), rng.normal(size=(20, 33, 3))
    return LandmarkTrack(30.0, 640, 480, marks, world, np.ones((20, 33)))


def test_the_same_seed_draws_the_same_cases() -> None:
    lengths = {"a": (90, 30.0), "b": (100, 60.0)}
    one, other = (draw_cases(lengths, 40, np.random.default_rng(4)) for _ in range(2))
    assert one == other


def test_hidden_spans_have_the_length_requested_and_both_ends() -> None:
    for case in draw_cases({"a": (90, 30.0)}, 200, np.random.default_rng(5)):
        assert 6 <= case.end - case.start <= 30
        assert case.start >= 1
        assert case.end < 90


def test_only_the_limb_is_hidden_and_only_then(track: LandmarkTrack) -> None:
    changed = hide(track, CASE).visibility == 0.0
    names = ("elbow", "wrist", "pinky", "index", "thumb")
    expected = np.zeros((20, 33), bool)
    expected[5:12, [landmark(f"left_{name}") for name in names]] = True
    assert np.array_equal(changed, expected)


def test_the_bridge_is_a_straight_line() -> None:
    time = np.arange(20.0)[:, None, None]
    line = np.broadcast_to(time, (20, 4, 3))
    broken = np.array(line)
    broken[5:12, 2] = 99.0
    assert np.allclose(bridged(broken, [2], 5, 12), line)


def test_the_error_is_that_of_the_limb_alone() -> None:
    rng = np.random.default_rng(2)
    right = rng.normal(size=(20, 12, 3))
    mine = 1.3 * right + 0.4
    mine[:, JOINTS.index("left_wrist"), 0] += 1.3 * 0.1
    truth = Truth("clip", right, np.array([0.0, -1.0, 0.0]))
    assert limb_error(mine, truth, CASE) == pytest.approx(50.0)
