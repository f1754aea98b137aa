"""Laws of time: a motion does not depend on when its frames were taken."""

import numpy as np
import pytest

from robojackson.motion.landmark_track import LandmarkTrack, evenly, uneven

TIMES = np.array([0.0, 0.1, 0.2, 0.5, 0.6, 0.9])


def moving(times: np.ndarray) -> LandmarkTrack:
    """Return a track in which everything moves by 1 a second."""
    points = np.tile(times[:, None, None], (1, 33, 3))
    fps = (len(times) - 1) / times[-1]
    time_s = times if uneven(times, fps) else None
    return LandmarkTrack(fps, 64, 48, points, points, np.ones((len(times), 33)), time_s)


def test_an_even_track_is_left_alone() -> None:
    track = moving(np.arange(6) / 10)
    assert evenly(track) is track


def test_a_steady_motion_stays_steady_at_a_varying_rate() -> None:
    track = evenly(moving(TIMES))
    steps = np.diff(track.landmarks[:, 0, 0])
    assert steps == pytest.approx(1.0 / track.fps)
    assert track.time_s is None


def test_the_clip_keeps_its_length_when_frames_are_lost() -> None:
    whole = moving(TIMES)
    assert (len(evenly(whole)) - 1) / whole.fps == pytest.approx(TIMES[-1], abs=0.5 / whole.fps)


def test_no_person_stays_no_person() -> None:
    track = moving(TIMES)
    track.landmarks[3] = np.nan
    assert np.isnan(evenly(track).landmarks[:, 0, 0]).any()


def test_in_a_hole_of_time_there_is_no_person() -> None:
    """A camera that froze for .6 s: what was danced then is unknown, no straight line."""
    times = np.delete(np.arange(90) / 30.0, range(31, 49))
    even = evenly(moving(times))
    when = np.arange(len(even)) / even.fps
    inside = (when > 30.0 / 30.0 + 1e-9) & (when < 49.0 / 30.0 - 1e-9)
    assert np.isnan(even.landmarks[inside]).all()
    assert np.isnan(even.visibility[inside]).all()
    assert not np.isnan(even.landmarks[~inside]).any()


def test_the_jitter_of_a_clock_is_no_varying_rate() -> None:
    times = np.arange(50) / 30 + np.random.default_rng(0).uniform(-0.004, 0.004, 50)
    assert not uneven(times - times[0], 30.0)


def test_the_nearest_frame_is_found_by_its_time() -> None:
    assert [moving(TIMES).nearest(t) for t in (0.0, 0.24, 0.4, 0.8, 9.0)] == [0, 2, 3, 5, 5]
