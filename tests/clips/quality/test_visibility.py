"""Laws of honest confidence: what is not in the picture was not seen, whoever says so."""

import numpy as np
import pytest

from robojackson.clips.quality.visibility import BESIDE_GAP, steady, turned_away, weigh_visibility
from robojackson.errors import NoPersonFound
from robojackson.motion.landmark_track import LandmarkTrack
from tests.fixtures.made_people import SIZE, row_of


def track_of(rows: np.ndarray) -> LandmarkTrack:
    return LandmarkTrack(30.0, *SIZE, rows[..., :3], rows[..., 3:6], rows[..., 6])


def standing(y: float = 240.0, frames: int = 20) -> np.ndarray:
    return np.array([row_of(320, y, sure=0.99)] * frames)


def test_a_body_in_full_view_keeps_its_visibility() -> None:
    track = track_of(standing())
    assert np.array_equal(weigh_visibility(track).visibility, track.visibility)
    assert weigh_visibility(track).notes == ()


def test_legs_below_the_picture_are_not_seen_and_reported() -> None:
    found = weigh_visibility(track_of(standing(y=460.0)))
    assert found.visibility[:, 25:33].max() == 0.0
    assert found.visibility[:, :23].min() == pytest.approx(0.99)
    assert found.notes == ("legs not seen in 100% of the frames: invented",)


def test_feet_alone_are_reported_as_feet() -> None:
    found = weigh_visibility(track_of(standing(y=410.0)))
    assert found.notes == ("feet not seen in 100% of the frames: invented",)


def test_a_share_of_the_frames_is_reported_as_it_is() -> None:
    rows = np.concatenate([standing(240.0, 5), standing(460.0, 15)])
    assert weigh_visibility(track_of(rows)).notes == (
        "legs not seen in 75% of the frames: invented",
    )


def test_a_face_is_refused() -> None:
    rows = np.array([row_of(320, 1300, tall=2200.0)] * 5)
    with pytest.raises(NoPersonFound, match=r"only the face is seen: the hips .* in 0% "):
        weigh_visibility(track_of(rows))


def test_a_bust_is_refused_as_the_upper_body() -> None:
    rows = np.array([row_of(320, 520, tall=900.0)] * 5)
    with pytest.raises(NoPersonFound, match="only the upper body is seen"):
        weigh_visibility(track_of(rows))


def test_a_face_on_the_back_of_a_head_is_not_believed() -> None:
    rows = standing()
    rows[:, :, 0] = 1.0 - rows[:, :, 0]
    found = weigh_visibility(track_of(rows))
    assert found.visibility[:, :11].max() < 0.2
    assert found.visibility[:, 11:].min() > 0.7
    assert found.notes == ("seen from behind in 100% of the frames: less certain",)


@pytest.mark.parametrize("turns", [0, 1, 2, 3])
def test_lying_and_standing_on_the_head_are_no_backs(turns: int) -> None:
    rows = standing()
    middle = rows[..., :2] * SIZE - [320, 240]
    turn = np.linalg.matrix_power(np.array([[0.0, -1.0], [1.0, 0.0]]), turns)
    rows[..., :2] = (middle @ turn.T + [320, 240]) / SIZE
    assert not turned_away(track_of(rows)).any()


def test_frames_beside_a_gap_are_less_certain() -> None:
    rows = standing()
    rows[10] = np.nan
    found = weigh_visibility(track_of(rows)).visibility[:, 11]
    assert found[9] < found[5]
    assert np.isnan(found[10])


def test_a_clip_without_a_person_is_left_to_the_next_stage() -> None:
    assert not weigh_visibility(track_of(standing() * np.nan)).detected.any()


@pytest.mark.parametrize("frames", [4, 20])
def test_two_frames_beside_a_gap_count_less_however_short_the_clip(frames: int) -> None:
    rows = standing(frames=frames)
    rows[-1] = np.nan
    expected = np.where(np.arange(frames) < frames - 3, 1.0, BESIDE_GAP)
    np.testing.assert_array_equal(steady(track_of(rows)), expected)
