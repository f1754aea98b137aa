"""Ends of a clip in which a person glides over the floor are left out; dances are not."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.motion.smpl_sequence import AIR, PLANTED, SLIDING, SmplSequence
from robojackson.retarget.retarget_config import RepairConfig, RetargetConfig
from robojackson.retarget.retargeting import retarget_motion
from robojackson.retarget.targets.clip_ends import danced_frames
from tests.fixtures.robots import human, stock


def standing(seconds: float = 3.0) -> SmplSequence:
    """Return a person who stands still."""
    still, frames = human("dance_b"), round(seconds * 30)
    frame = {name: np.repeat(getattr(still, name)[:1], frames, 0)
             for name in ("global_orient", "body_pose", "transl", "joints", "keypoints_w",
                          "confidence", "valid")}  # fmt: skip
    return replace(still, fps=30.0, contact=np.full((frames, 4), PLANTED), **frame)


def moved(still: SmplSequence, frames: slice, speed: float, contact: int) -> SmplSequence:
    """Return the same person, carried along x over some frames at a speed, m/s."""
    velocity, states = np.zeros(len(still)), still.contact.copy()
    velocity[frames], states[frames] = speed, contact
    keypoints = still.keypoints_w.copy()
    keypoints[:, :, 0] += np.cumsum(velocity)[:, None] / still.fps
    return replace(still, keypoints_w=keypoints, contact=states)


@pytest.mark.parametrize("speed", [2.0, 4.0])
def test_a_glide_at_the_end_is_left_out(speed: float) -> None:
    glides = moved(standing(), slice(78, 90), speed, SLIDING)
    kept = danced_frames(glides)
    assert kept.start == 0
    assert 72 <= kept.stop <= 78


def test_a_glide_at_the_beginning_is_left_out() -> None:
    kept = danced_frames(moved(standing(), slice(0, 12), 3.0, SLIDING))
    assert 12 <= kept.start <= 16
    assert kept.stop == 90


@pytest.mark.parametrize(
    ("speed", "contact"),
    [(0.9, SLIDING), (4.0, PLANTED), (4.0, AIR)],
    ids=["moonwalk", "run", "leap"],
)
def test_a_dance_stays_whole(speed: float, contact: int) -> None:
    assert danced_frames(moved(standing(), slice(70, 90), speed, contact)) == slice(0, 90)


def test_a_glide_in_the_middle_stays() -> None:
    assert danced_frames(moved(standing(), slice(40, 50), 3.0, SLIDING)) == slice(0, 90)


def test_a_clip_that_mostly_glides_stays_whole() -> None:
    assert danced_frames(moved(standing(), slice(10, 90), 3.0, SLIDING)) == slice(0, 90)


@pytest.mark.parametrize("clip", ["dance_b", "walk"])
def test_bundled_dances_stay_whole(clip: str) -> None:
    sequence = human(clip)
    assert danced_frames(sequence) == slice(0, len(sequence))


@pytest.mark.medium
def test_a_reference_begins_where_the_dance_begins() -> None:
    glides = moved(standing(1.5), slice(0, 9), 3.0, SLIDING)
    config = RetargetConfig(cyclic="no", repair=RepairConfig(target_share=0.0))
    found = retarget_motion(glides, stock(), config)
    kept = danced_frames(glides)
    assert found.source_time_s[0] == pytest.approx(kept.start / 30, abs=0.02)
    assert found.scorecard["trimmed_s"] == pytest.approx(kept.start / 30, abs=0.02)
    whole = retarget_motion(glides, stock(), replace(config, cut_glides=False))
    assert whole.source_time_s[0] == 0.0
    assert len(whole) > len(found)
