"""Animated pictures are as long as their film."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from robojackson.report.video.animation import FPS, durations_ms, write_animation
from robojackson.report.video.encoder import write_video
from tests.fixtures.bad_clips import write_timed

FRAMES = 60


def durations_in(animation: Path) -> list[int]:
    """Return the duration of each picture in a file, milliseconds."""
    durations = []
    with Image.open(animation) as image:
        for index in range(image.n_frames):
            image.seek(index)
            image.load()
            durations.append(image.info["duration"])
    return durations


@pytest.mark.parametrize("kind", ["gif", "webp"])
@pytest.mark.parametrize("fps", [5, 12, 24, 25, 30, 50])
def test_an_animation_is_as_long_as_its_film(fps: int, kind: str, tmp_path: Path) -> None:
    pictures = [np.full((32, 48, 3), 4 * k, np.uint8) for k in range(FRAMES)]
    film = write_video(pictures, fps, tmp_path / "film.mp4")
    durations = durations_in(write_animation(film, tmp_path / f"film.{kind}", kind))
    assert len(durations) <= FPS * FRAMES / fps + 1
    assert sum(durations) == pytest.approx(1000 * FRAMES / fps, abs=5)


def test_a_film_of_more_than_a_minute_is_shown_whole(tmp_path: Path) -> None:
    pictures = [np.full((32, 48, 3), k % 250, np.uint8) for k in range(5 * 61)]
    film = write_video(pictures, 5, tmp_path / "film.mp4")
    assert sum(durations_in(write_animation(film, tmp_path / "film.gif", "gif"))) == 61_000


@pytest.mark.parametrize("kind", ["gif", "webp"])
def test_pictures_of_a_varying_rate_are_shown_at_their_times(kind: str, tmp_path: Path) -> None:
    """A second at 30 a second, a pause of 2.5 s, then a second at 5 a second."""
    times = [*np.arange(30) / 30, *(3.5 + np.arange(5) / 5)]
    film = tmp_path / "phone.mp4"
    write_timed(film, ((t, np.full((32, 48, 3), 7 * k, np.uint8)) for k, t in enumerate(times)))
    durations = durations_in(write_animation(film, tmp_path / f"film.{kind}", kind))
    assert durations == pytest.approx([100] * 9 + [2600] + [200] * 4 + [durations[-1]], abs=10)
    assert sum(durations) == pytest.approx(4300, abs=60)


def test_durations_are_whole_units_whose_sum_does_not_wander() -> None:
    durations = durations_ms([index / 30 for index in range(1001)])
    assert set(durations) == {30, 40}
    assert sum(durations) == 33_330
