"""Laws of the pass in reverse order: where it is made, and which frames it gives."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.mocap.truth import JOINTS as JOINT_NAMES
from benchmarks.mocap.truth import load_truth
from robojackson.clips.people.dancer import DancerConfig, track_dancer
from robojackson.clips.people.reverse_pass import (
    JOINTS,
    LONGEST,
    ReversePassConfig,
    choose,
    parts,
    suspect,
    track_in_reverse,
)
from robojackson.clips.pose_detector import detect
from robojackson.clips.video import VideoLimits, probe
from robojackson.metrics.pose_error import pa_mpjpe
from robojackson.mocap.landmarks.blazepose import landmark

CLIPS = Path(__file__).parents[3] / "clips"
TRACK = Path(__file__).parents[2] / "golden" / "hip_shake_track.npz"
CONFIG = ReversePassConfig()
SIZE = (640, 480)


@pytest.fixture
def rows() -> np.ndarray:
    """Return the rows of a dancer who stands upright and moves smoothly."""
    with np.load(TRACK) as track:
        parts_ = (track["landmarks"], track["world_landmarks"], track["visibility"][..., None])
        return np.concatenate(parts_, -1)[:60].astype(float)


def lost(rows: np.ndarray, frames: slice) -> np.ndarray:
    """Return rows in which the legs are found half a body away, now here, now there."""
    spoilt = rows.copy()
    wander = np.random.default_rng(0).normal(0.0, 0.02, (frames.stop - frames.start, 1))
    spoilt[frames, 25:, 0] += 0.4 + wander
    return spoilt


def test_a_clip_that_is_tracked_well_is_not_read_again(rows: np.ndarray) -> None:
    def no_images():  # type: ignore[no-untyped-def]
        raise AssertionError("read")
        yield

    assert not suspect(rows, SIZE, CONFIG).any()
    found, used = track_in_reverse(no_images(), 30.0, SIZE, "full", rows, CONFIG)
    assert found is rows
    assert used == 0


def test_jumps_gaps_and_hanging_trunks_are_suspect(rows: np.ndarray) -> None:
    assert np.flatnonzero(suspect(lost(rows, slice(20, 30)), SIZE, CONFIG)).tolist() == [20, 30]
    gap = rows.copy()
    gap[[0, 10, 11, 59]] = np.nan
    assert np.flatnonzero(suspect(gap, SIZE, CONFIG)).tolist() == [10, 11]
    turned = rows.copy()
    turned[30:33, :, 1] = 1.0 - turned[30:33, :, 1]
    assert set(range(30, 33)) <= set(np.flatnonzero(suspect(turned, SIZE, CONFIG)))


def test_nobody_in_the_clip_is_not_suspect(rows: np.ndarray) -> None:
    assert not suspect(np.full_like(rows, np.nan), SIZE, CONFIG).any()


def test_each_pass_gives_the_frames_that_the_other_lost(rows: np.ndarray) -> None:
    """The failures of both overlap nowhere: the truth comes out, and the first pass where both are
    the same."""
    first, second = lost(rows, slice(20, 30)), lost(rows, slice(12, 17))
    better = choose(first, second, SIZE, CONFIG)
    assert np.flatnonzero(better).tolist() == list(range(20, 30))
    assert np.array_equal(np.where(better[:, None, None], second, first), rows)


def test_where_both_fail_the_shorter_failure_is_left(rows: np.ndarray) -> None:
    first, second = lost(rows, slice(20, 30)), lost(rows, slice(18, 23))
    chosen = np.where(choose(first, second, SIZE, CONFIG)[:, None, None], second, first)
    off = np.abs(chosen - rows)[:, JOINTS].max((1, 2)) > 0.1
    assert off.sum() < 6


def test_a_person_whom_only_the_second_pass_found_is_taken(rows: np.ndarray) -> None:
    first = rows.copy()
    first[:25] = np.nan
    assert np.flatnonzero(choose(first, rows, SIZE, CONFIG)).tolist() == list(range(25))
    assert choose(np.full_like(rows, np.nan), rows, SIZE, CONFIG).all()
    assert not choose(rows, np.full_like(rows, np.nan), SIZE, CONFIG).any()


def test_a_still_person_elsewhere_is_not_taken_for_the_dancer(rows: np.ndarray) -> None:
    """A poster moves less than any dancer."""
    poster = np.repeat(rows[:1], len(rows), axis=0)
    poster[..., 0] += 0.45
    assert not choose(lost(rows, slice(20, 30)), poster, SIZE, CONFIG).any()


def test_long_stretches_are_tracked_in_parts_that_begin_before_they_end() -> None:
    frames = np.zeros(600, bool)
    frames[10 : 10 + 2 * LONGEST + 5] = True
    frames[500:520] = True
    end = 10 + 2 * LONGEST + 5
    assert parts(frames, 30) == [
        (slice(10, 10 + LONGEST), 10 + LONGEST + 30),
        (slice(10 + LONGEST, 10 + 2 * LONGEST), end),
        (slice(10 + 2 * LONGEST, end), end),
        (slice(500, 520), 520),
    ]


@pytest.mark.slow
def test_a_spinning_dancer_is_tracked_more_steadily() -> None:
    """A real failure: in the order of the clip legs are lost in the turn."""
    path = CLIPS / "heldout" / "spin.mp4"
    info = probe(path, VideoLimits())
    before = detect(path, info)
    after = track_dancer(path, info, "full", DancerConfig())
    assert any("tracked in reverse order" in note for note in after.notes)
    truth = load_truth("spin").joints
    marks = [landmark(name) for name in JOINT_NAMES]
    errors = [pa_mpjpe(track.world_landmarks[:, marks], truth) for track in (before, after)]
    assert errors[1] < 0.9 * errors[0]
