"""All panels show the same moment, over cycles and past the end."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.clips.video import VideoLimits
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video.film import VideoConfig
from robojackson.report.video.timeline import cut_note, person_points, reference_qpos, timeline


def test_cyclic_reference_starts_again_after_a_cycle(reference: ReferenceMotion) -> None:
    when = timeline(reference, 30.0, 12, 2 * len(reference), 1 / reference.dt, 99.0)
    np.testing.assert_array_equal(when.step[27:54], when.step[:27])


def test_cycles_are_counted(reference: ReferenceMotion) -> None:
    when = timeline(reference, 30.0, 12, 2 * len(reference), 1 / reference.dt, 99.0)
    np.testing.assert_array_equal(when.cycle, np.repeat([0, 1], 27))


def test_motion_that_is_not_cyclic_holds_its_last_step(reference: ReferenceMotion) -> None:
    once = replace(reference, cyclic=False)
    when = timeline(once, 30.0, 12, 2 * len(once), 1 / once.dt, 99.0)
    assert set(when.step[27:]) == {len(once) - 1}


def test_frame_is_the_one_that_the_step_was_made_from(reference: ReferenceMotion) -> None:
    when = timeline(reference, 30.0, 12, 0, 30.0, 99.0)
    np.testing.assert_array_equal(when.frame, np.arange(12))


def test_trimmed_start_of_the_clip_is_not_shown(reference: ReferenceMotion) -> None:
    late = replace(reference, source_time_s=reference.source_time_s + 0.1)
    assert timeline(late, 30.0, 40, 0, 30.0, 99.0).frame[0] == 3


def test_rollout_that_ends_early_is_held_and_marked(reference: ReferenceMotion) -> None:
    when = timeline(reference, 30.0, 12, 10, 1 / reference.dt, 99.0)
    assert when.rollout.max() == 9
    np.testing.assert_array_equal(np.flatnonzero(when.ended), np.arange(10, 27))


def test_video_is_no_longer_than_requested(reference: ReferenceMotion) -> None:
    assert len(timeline(reference, 30.0, 12, 4000, 30.0, 2.0)) == 60


def test_reference_moves_on_by_a_cycle(reference: ReferenceMotion) -> None:
    when = timeline(reference, 30.0, 12, 2 * len(reference), 1 / reference.dt, 99.0)
    qpos = reference_qpos(reference, when)
    np.testing.assert_allclose(qpos[27, :3] - qpos[0, :3], reference.cycle_offset)


def test_a_person_who_walks_goes_on_after_a_cycle(
    reference: ReferenceMotion, sequence: SmplSequence
) -> None:
    """The expected path is a straight line: 1.5 m/s to the left, and a bouncing pelvis."""
    walked = np.array(sequence.keypoints_w, float)
    walked[:, :, 1] += 1.5 * np.arange(12)[:, None] / 30.0
    walking = replace(
        sequence, keypoints_w=walked + [0.0, 0.0, 0.1] * (np.arange(12) % 2)[:, None, None]
    )
    cycle = replace(reference, dt=0.4 / len(reference), source_time_s=np.arange(27) * 0.4 / 27)
    when = timeline(cycle, 30.0, 12, 3 * len(cycle), 30.0, 99.0)
    moved = person_points(walking, when)
    np.testing.assert_allclose(moved[:, 0, 1], moved[0, 0, 1] + 1.5 * when.time_s, atol=1e-9)
    assert np.ptp(moved[:, 0, 2]) == pytest.approx(0.1)


def test_a_person_of_a_motion_that_ends_stays_where_the_clip_has_it(
    reference: ReferenceMotion, sequence: SmplSequence
) -> None:
    for motion in (replace(reference, cyclic=False), reference):
        when = timeline(motion, 30.0, 12, 0, 30.0, 99.0)
        np.testing.assert_array_equal(
            person_points(sequence, when), sequence.keypoints_w[when.frame]
        )


def test_a_dance_that_is_cut_says_what_is_shown_of_what(reference: ReferenceMotion) -> None:
    long = replace(reference, dt=1.0)
    when = timeline(long, 30.0, 12, 0, 30.0, 20.0)
    note = cut_note(long, len(when) / 30.0, 30.0)
    assert note.startswith("The first 20.0 s of 27.0 s are shown")
    assert "--set render.max_seconds=27 " in note


def test_a_dance_that_is_shown_whole_has_no_note(reference: ReferenceMotion) -> None:
    for dt in (reference.dt, 0.7401):
        motion = replace(reference, dt=dt)
        when = timeline(motion, 30.0, 12, 0, 30.0, 20.0)
        assert cut_note(motion, len(when) / 30.0, 30.0) == ""


def test_every_clip_of_the_default_length_is_shown_whole() -> None:
    longest = VideoLimits().max_duration_s
    assert longest is not None
    assert VideoConfig().max_seconds >= longest
