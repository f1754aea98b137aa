"""The authored dance: planted feet, a cycle that closes, limbs that reach."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tools.render import deepmimic
from tools.render.hip_shake import Dance, Measures, author, solve_leg

BODY = Measures(
    hips={1.0: np.array([0.0, 0.12, 0.0]), -1.0: np.array([0.0, -0.12, 0.0])},
    thigh=0.45, shin=0.46, ankle_height=0.08, scale=1.1,
)  # fmt: skip
DOWN = np.array([0.0, -1.0, 0.0])
"""In a motion file y is up, z right."""


def ankle(motion: deepmimic.Motion, name: str, side: float) -> np.ndarray:
    """Return an ankle by forward kinematics of a leg in the axes of the file, metres."""
    x, y, z = BODY.hips[side]
    hip = motion.root_position * BODY.scale + motion.rotations["root"].apply([x, z, -y])
    knee = hip + motion.rotations[f"{name}_hip"].apply(DOWN * BODY.thigh)
    return knee + motion.rotations[f"{name}_knee"].apply(DOWN * BODY.shin)


@pytest.mark.parametrize(("name", "side"), [("left", 1.0), ("right", -1.0)])
def test_ankles_stand_at_the_stance(name: str, side: float) -> None:
    dance = Dance()
    expected = [0.0, BODY.ankle_height, -side * dance.half_stance]
    track = ankle(author(dance, BODY), name, side)
    np.testing.assert_allclose(track, np.tile(expected, (len(track), 1)), atol=1e-9)


def test_a_cycle_of_four_seconds_has_120_frames() -> None:
    assert len(author(Dance(), BODY)) == 120


def test_sample_rate_does_not_change_the_dance() -> None:
    coarse, fine = author(Dance(), BODY), author(Dance(fps=60.0), BODY)
    np.testing.assert_allclose(coarse.root_position, fine.root_position[::2], atol=1e-12)


@pytest.mark.parametrize("name", deepmimic.TREE_ORDER)
def test_every_joint_crosses_the_seam_without_a_jerk(name: str) -> None:
    """The turn over the seam is no larger than the largest inside the cycle."""
    rotation = author(Dance(), BODY).rotations[name]
    turns = (rotation[:-1].inv() * rotation[1:]).magnitude()
    seam = (rotation[-1].inv() * rotation[0]).magnitude()
    assert seam <= turns.max() + 1e-9


def test_leg_out_of_reach_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot reach"):
        solve_leg(np.array([[0.0, 0.0, 2.0]]), np.zeros(3), np.array([1.0, 0, 0]), 0.45, 0.46)


def test_knee_bends_towards_the_toe() -> None:
    hip, toe = np.array([[0.0, 0.0, 0.8]]), np.array([0.6, 0.8, 0.0])
    thigh, _ = solve_leg(hip, np.zeros(3), toe, 0.45, 0.46)
    knee = thigh.apply([0.0, 0.0, -0.45])[0] + hip[0]
    assert knee @ toe > 0.1


def test_leg_rotations_are_proper() -> None:
    thigh, shin = solve_leg(
        np.array([[0.05, 0.1, 0.8]]), np.zeros(3), np.array([1.0, 0.0, 0.0]), 0.45, 0.46
    )
    assert isinstance(thigh, Rotation)
    np.testing.assert_allclose(np.linalg.det([*thigh.as_matrix(), *shin.as_matrix()]), 1.0)
