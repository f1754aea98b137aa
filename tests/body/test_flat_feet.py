"""Feet of other skeletons: flat where they stand, whatever slope the skeleton draws them with."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.body.flat_feet import standing_slopes, vertical, with_flat_soles
from robojackson.body.skeleton import REST_JOINTS, keypoint
from tests.fixtures.person import UPRIGHT

FPS = 30.0
FEET = [keypoint(f"{side}_{end}") for side in ("left", "right") for end in ("foot", "big_toe")]


@pytest.fixture(scope="module")
def standing() -> np.ndarray:
    """Return three seconds of a person who stands still, (90, 29, 3), metres."""
    return np.repeat(UPRIGHT.apply(REST_JOINTS)[None] + [0.0, 0.0, 0.95], 90, axis=0)


def lowered(points: np.ndarray, side: str, degrees: np.ndarray | float) -> np.ndarray:
    """Return the keypoints with one foot's toes lowered about the ankle."""
    knee, ankle = (points[:, keypoint(f"{side}_{name}")] for name in ("knee", "ankle"))
    axis = np.cross(knee - ankle, points[:, keypoint(f"{side}_big_toe")] - ankle)
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    angle = np.radians(np.broadcast_to(degrees, len(points)))
    turn = Rotation.from_rotvec(axis * angle[:, None])
    moved = points.copy()
    for end in ("foot", "big_toe"):
        at = keypoint(f"{side}_{end}")
        moved[:, at] = ankle + turn.apply(points[:, at] - ankle)
    return moved


@pytest.mark.parametrize("axes", [[0, 1, 2], [1, 2, 0]], ids=["z up", "y up"])
def test_soles_that_point_up_are_levelled(standing: np.ndarray, axes: list[int]) -> None:
    raised = lowered(lowered(standing, "left", -20.0), "right", -15.0)
    turned, angles = with_flat_soles(raised[..., axes], FPS)
    slopes, _ = standing_slopes(turned, FPS, vertical(turned))
    level, _ = standing_slopes(standing, FPS, vertical(standing))
    np.testing.assert_allclose(np.degrees(slopes), np.degrees(level), atol=0.5)
    np.testing.assert_allclose(np.degrees(angles), [20.0, 15.0], atol=0.5)
    others = np.delete(np.arange(29), FEET)
    np.testing.assert_array_equal(turned[:, others], raised[..., axes][:, others])


def test_steps_on_tiptoe_do_not_count(standing: np.ndarray) -> None:
    raised = lowered(lowered(standing, "left", -20.0), "right", -20.0)
    plain = with_flat_soles(raised, FPS)[1]
    danced = raised.copy()
    danced[:55, :, 2] += 0.1
    tiptoe = lowered(lowered(danced[:55], "left", 55.0), "right", 55.0)
    found = with_flat_soles(np.concatenate([tiptoe, danced[55:]]), FPS)[1]
    np.testing.assert_allclose(np.degrees(found), np.degrees(plain), atol=1.0)


def test_feet_that_never_stand_are_left_alone(standing: np.ndarray) -> None:
    running = standing + np.linspace(0.0, 9.0, len(standing))[:, None, None] * [1.0, 0.0, 0.0]
    turned, angles = with_flat_soles(running, FPS)
    assert not angles.any()
    np.testing.assert_array_equal(turned, running)


def test_our_own_feet_are_not_turned(standing: np.ndarray) -> None:
    _, angles = with_flat_soles(standing, FPS)
    assert np.degrees(np.abs(angles)).max() < 0.5
