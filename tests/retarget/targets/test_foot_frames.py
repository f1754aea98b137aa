"""The turn of a human foot is that of its sole, whatever the slope of its skeleton."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.motion.smpl_sequence import AIR, PLANTED
from robojackson.retarget.targets.foot_frames import foot_frames
from robojackson.retarget.targets.human_clip import HumanClip

FRAMES, FLAT = 20, 12


def _walker(slope_deg: float, pitches_deg: np.ndarray, heading_deg: float):
    """Return a foot that is flat in the first frames, then pitched; its toe is below its ankle."""
    turn = Rotation.from_euler("z", heading_deg, degrees=True)
    turns = turn * Rotation.from_rotvec(np.radians(pitches_deg)[:, None] * [0.0, 1.0, 0.0])
    slope = np.radians(slope_deg)
    toe = turns.apply([0.2 * np.cos(slope), 0.0, -0.2 * np.sin(slope)])
    human = {}
    for side in ("left", "right"):
        ankle = np.tile([0.0, 0.0, 0.1], (FRAMES, 1))
        human |= {f"{side}_ankle": ankle, f"{side}_big_toe": ankle + toe}
        human |= {f"{side}_knee": ankle + [0.0, 0.0, 0.4]}
    contact = np.full((FRAMES, 4), AIR)
    contact[:FLAT] = PLANTED
    clip = HumanClip(
        np.arange(FRAMES) / 30, np.zeros((FRAMES, 29, 3)), contact, np.ones(FRAMES, bool), 1 / 30,
        None,
    )  # fmt: skip
    return human, clip, turns.as_matrix()


@pytest.mark.parametrize("slope_deg", [5.0, 19.0, 30.0])
@pytest.mark.parametrize("heading_deg", [0.0, 140.0])
def test_the_frame_is_the_turn_of_the_sole(slope_deg: float, heading_deg: float):
    pitches = np.zeros(FRAMES)
    pitches[FLAT:] = np.linspace(-30, 40, FRAMES - FLAT)
    human, clip, expected = _walker(slope_deg, pitches, heading_deg)
    np.testing.assert_allclose(foot_frames(human, clip)["left"], expected, atol=1e-9)


def test_without_a_flat_foot_the_slope_is_that_of_our_own_skeleton():
    human, clip, _ = _walker(19.3, np.zeros(FRAMES), 0.0)
    clip.contact[:] = AIR
    frames = foot_frames(human, clip)["right"]
    assert np.degrees(np.arcsin(np.abs(frames[:, 2, 0]))).max() < 0.5
