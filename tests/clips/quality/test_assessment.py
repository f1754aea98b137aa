"""The folder of difficult clips, assessed once: the ranking is what a person would choose."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robojackson.clips.quality import candidate_ranking
from robojackson.clips.quality.assessment import Assessment, AssessmentConfig, assess_video
from robojackson.clips.quality.candidate_ranking import FilterConfig, Ranked
from robojackson.clips.quality.duplicates import DuplicateConfig, find_duplicates
from robojackson.clips.quality.stability import StabilityConfig, stability
from robojackson.motion.landmark_track import LandmarkTrack
from tests.fixtures.difficult_clips import DANCERS, REAL

pytestmark = pytest.mark.xdist_group("assessment")

GOOD = {*DANCERS, REAL}
REASONS = {
    "two_people": "2 people in view",
    "slideshow": "a slideshow",
    "cartoon": "a drawing",
    "stick_figure": "no person found in 60 of 60 frames",
    "cut": "1 cut",
    "shaken": "the camera moves",
    "black": "no person found in 45 of 45 frames",
    "mirrored": "a mirrored copy of hip_shake",
}
Assessed = dict[str, Assessment]


@pytest.fixture(scope="module")
def assessed(difficult: Path) -> Assessed:
    config = AssessmentConfig()
    return {path.stem: assess_video(path, config) for path in sorted(difficult.glob("*.mp4"))}


@pytest.fixture(scope="module")
def ranking(assessed: Assessed) -> list[Ranked]:
    config = FilterConfig()
    order = candidate_ranking.order({name: j.stability for name, j in assessed.items()}, config)
    against = {
        n: candidate_ranking.objections(j.stability, j.quality, config) for n, j in assessed.items()
    }
    fit = [name for name in order if not against[name]]
    fit.sort(key=lambda name: -assessed[name].quality.person_height_px)
    copied = find_duplicates({name: assessed[name].track for name in fit}, DuplicateConfig())
    return candidate_ranking.rank(order, against, copied)


@pytest.mark.medium
def test_the_steadiest_dancer_is_chosen(ranking: list[Ranked]) -> None:
    assert (ranking[0].name, ranking[0].decision) == ("hip_shake", "chosen")


@pytest.mark.medium
def test_the_good_clips_stand_before_all_others(ranking: list[Ranked]) -> None:
    assert {place.name for place in ranking if place.place} == GOOD


@pytest.mark.medium
@pytest.mark.parametrize("name", REASONS)
def test_a_bad_clip_is_rejected_for_what_is_wrong_with_it(ranking: list[Ranked], name: str) -> None:
    reason = next(place.reason for place in ranking if place.name == name)
    assert REASONS[name] in reason
    assert ";" not in reason


@pytest.mark.medium
def test_the_cartoon_loses_though_algorithm_1_likes_it(
    assessed: Assessed, ranking: list[Ranked]
) -> None:
    """The paper's own example: a character that dances is steadier than a dancer."""
    scores = {name: j.stability.stability_score for name, j in assessed.items()}
    assert scores["cartoon"] < scores["dance_b"]
    assert "cartoon" not in {place.name for place in ranking if place.place}


@pytest.mark.medium
def test_the_score_is_algorithm_1(assessed: Assessed) -> None:
    """Computed again, landmark by landmark, without numpy's arithmetic."""
    for name in ("hip_shake", "slideshow", "black"):
        track = assessed[name].track
        missing, jitter = 0, 0.0
        before = None
        for points, seen in zip(track.landmarks.tolist(), track.visibility.tolist(), strict=True):
            missing += sum(1 for v in seen if math.isnan(v) or v < 0.5)
            now = None if math.isnan(points[0][0]) else points
            if now and before:
                steps = [
                    math.hypot(a[0] - b[0], a[1] - b[1]) for a, b in zip(now, before, strict=True)
                ]
                jitter += sum(steps) / 33
            before = now
        assert assessed[name].stability.stability_score == pytest.approx(missing + jitter, abs=1e-9)


@pytest.mark.medium
def test_a_shaken_camera_hardly_ever_stands_still(assessed: Assessed) -> None:
    assert assessed["shaken"].quality.static_share < 0.2
    assert assessed["hip_shake"].quality.static_share == 1.0


@pytest.mark.medium
def test_the_person_is_as_tall_as_the_drawing(assessed: Assessed) -> None:
    """The clip that is 7/8 as large shows a person who is."""
    ratio = (
        assessed["mirrored"].quality.person_height_px
        / assessed["hip_shake"].quality.person_height_px
    )
    assert ratio == pytest.approx(7 / 8, rel=0.02)


@pytest.mark.medium
def test_every_dancer_is_in_full_view(assessed: Assessed) -> None:
    assert min(assessed[name].quality.full_body_share for name in DANCERS) > 0.95


@pytest.mark.medium
def test_filters_can_be_switched_off(assessed: Assessed) -> None:
    off = FilterConfig(people=None, cuts=None, static_share=None, flat_share=None)
    for name in ("two_people", "cut", "shaken", "cartoon"):
        assert (
            candidate_ranking.objections(assessed[name].stability, assessed[name].quality, off)
            == []
        )


@pytest.mark.medium
def test_by_frame_the_order_does_not_favour_short_clips(assessed: Assessed) -> None:
    scores = {name: assessed[name].stability for name in GOOD}
    by_frame = candidate_ranking.order(scores, FilterConfig(rank_by="frame"))
    expected = sorted(
        GOOD, key=lambda n: scores[n].jitter_per_frame + scores[n].missing_joints_per_frame
    )
    assert by_frame == expected


def test_by_second_a_short_clip_is_not_favoured() -> None:
    """Half of a clip has half of its sum and the same score a second."""
    rng = np.random.default_rng(0)
    marks = rng.normal(size=(120, 33, 3)).cumsum(0) / 100
    whole = LandmarkTrack(30.0, 64, 48, marks, marks, np.ones((120, 33)))
    half = replace(
        whole, landmarks=marks[:60], world_landmarks=marks[:60], visibility=np.ones((60, 33))
    )
    shaky = replace(half, landmarks=1.3 * marks[:60])
    scores = {n: stability(t, StabilityConfig()) for n, t in (("whole", whole), ("shaky", shaky))}
    assert stability(half, StabilityConfig()).score_per_second == pytest.approx(
        scores["whole"].score_per_second, rel=0.1
    )
    assert candidate_ranking.order(scores, FilterConfig(rank_by="sum")) == ["shaky", "whole"]
    assert candidate_ranking.order(scores, FilterConfig()) == ["whole", "shaky"]


def test_the_score_a_second_does_not_count_frames() -> None:
    """The same clip at 60 frames a second, a quarter of its landmarks missing."""
    rng = np.random.default_rng(0)
    marks = np.sin(np.linspace(0.0, 6.0, 240))[:, None, None] * np.ones((1, 33, 3)) / 10
    seen = np.repeat(rng.uniform(size=(120, 33)) > 0.25, 2, axis=0).astype(float)
    fast = LandmarkTrack(60.0, 64, 48, marks, marks, seen)
    slow = LandmarkTrack(30.0, 64, 48, marks[::2], marks[::2], seen[::2])
    found = [stability(track, StabilityConfig()).score_per_second for track in (fast, slow)]
    assert found[0] == pytest.approx(found[1], rel=0.01)


@pytest.mark.medium
def test_a_clip_without_a_person_comes_last_however_low_its_score(assessed: Assessed) -> None:
    order = candidate_ranking.order({n: j.stability for n, j in assessed.items()}, FilterConfig())
    assert set(order[-2:]) == {"black", "stick_figure"}


@pytest.mark.medium
def test_figures_are_plain_numbers(assessed: Assessed) -> None:
    values = [v for j in assessed.values() for v in vars(j.quality).values()]
    assert all(type(v) in (int, float) and np.isfinite(v) for v in values)
