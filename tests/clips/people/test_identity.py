"""Laws of identities: no person takes another's, whatever hides them."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from robojackson.clips.people.identity import IdentityConfig, identify
from robojackson.clips.people.person_detection import PersonDetection
from tests.fixtures.made_people import BLUE, RED, SIZE, hips_x, seen

FPS = 30.0
Line = Callable[[float], float]


def tracks(frames: Sequence[Sequence[PersonDetection]]) -> list[np.ndarray]:
    return identify(frames, np.arange(len(frames)) / FPS, SIZE, IdentityConfig())


def rightward(t: float) -> float:
    return 120.0 + 200.0 * t


def leftward(t: float) -> float:
    return 520.0 - 200.0 * t


def crossing(hidden_px: float, swap: bool, tall: tuple[float, float] = (200.0, 200.0)) -> list:
    """Return two people who change places in two seconds; the second is hidden while nearer than a
    distance."""
    frames = []
    for index in range(60):
        a, b = rightward(index / FPS), leftward(index / FPS)
        people = [seen(a, tall=tall[0])]
        if abs(a - b) > hidden_px:
            people.append(seen(b, tall=tall[1]))
        frames.append(people[::-1] if swap and index % 2 else people)
    return frames


def test_one_person_is_one_track_without_gaps() -> None:
    (track,) = tracks([[seen(100 + i)] for i in range(40)])
    assert hips_x(track) == pytest.approx(100 + np.arange(40))


def test_the_order_of_the_sightings_does_not_matter() -> None:
    found = [hips_x(track) for track in tracks(crossing(hidden_px=0, swap=True))]
    straight = [hips_x(track) for track in tracks(crossing(hidden_px=0, swap=False))]
    for track in found:
        assert any(np.array_equal(track, other, equal_nan=True) for other in straight)


@pytest.mark.parametrize("hidden_px", [60, 120])
def test_two_in_the_same_clothes_who_cross_keep_their_ways(hidden_px: float) -> None:
    found = tracks(crossing(hidden_px, swap=False))
    assert len(found) == 2
    times = np.arange(60) / FPS
    for track in found:
        x = hips_x(track)
        known = ~np.isnan(x)
        line = rightward if x[0] < 300 else leftward
        assert x[known] == pytest.approx([line(t) for t in times[known]])


def test_a_stranger_who_comes_when_one_left_is_not_the_same() -> None:
    frames = [[seen(100, colours=RED)] for _ in range(30)] + [[]] * 15
    frames += [[seen(110, colours=BLUE)] for _ in range(30)]
    assert len(tracks(frames)) == 2


def test_who_leaves_and_returns_is_the_same() -> None:
    frames = [[seen(100)] for _ in range(30)] + [[]] * 45 + [[seen(130)] for _ in range(30)]
    (track,) = tracks(frames)
    assert np.isnan(hips_x(track)[30:75]).all()
    assert not np.isnan(hips_x(track)[75:]).any()


def test_a_ghost_of_a_few_frames_is_no_person() -> None:
    frames = [[seen(100)] + ([seen(400)] if 20 <= i < 24 else []) for i in range(90)]
    assert len(tracks(frames)) == 1


def test_a_person_beside_a_ghost_of_the_first_frame_is_found() -> None:
    """All that followed might have been either of the two, so that no person was found."""
    frames = [[seen(100 + i)] for i in range(60)]
    frames[0] = [seen(100), seen(130)]
    (track,) = tracks(frames)
    assert (~np.isnan(hips_x(track))).sum() >= 59


def test_the_largest_steady_person_is_the_first() -> None:
    frames = [
        [seen(100, tall=120), seen(300, tall=160), *([seen(520, tall=260)] if i < 25 else [])]
        for i in range(90)
    ]
    first = [float(np.nanmedian(hips_x(track))) for track in tracks(frames)]
    assert first == pytest.approx([300, 100, 520])


def test_no_person_in_any_frame_is_no_track() -> None:
    assert tracks([[]] * 10) == []


@pytest.mark.parametrize("fps", [30.0, 12.0, 10.0, 9.0])
def test_two_who_cross_keep_their_ways_at_low_frame_rates(fps: float) -> None:
    """A frame of less than ten a second is longer than the pause that ends a tracklet."""
    times = np.arange(round(6 * fps)) / fps
    ways = 120.0 + 400.0 * times / 6, 520.0 - 400.0 * times / 6
    frames = [[seen(a), seen(b)] for a, b in zip(*ways, strict=True)]
    found = identify(frames, times, SIZE, IdentityConfig())
    assert len(found) == 2
    for track in found:
        x = hips_x(track)
        known = ~np.isnan(x)
        assert known.mean() > 0.8
        assert x[known] == pytest.approx(ways[int(x[0] > 300)][known])
