"""Sound: read from a clip, slowed with its pitch and at its pictures, and its beats."""

from pathlib import Path

import numpy as np
import pytest

from robojackson.clips.sound import RATE, Sound, music_beats, read_sound
from robojackson.metrics.beat_alignment import alignment, half_a_beat, motion_beats
from robojackson.report.video.encoder import write_video
from robojackson.report.video.soundtrack import HOP, warped

BEAT_S, FPS = 0.5, 30


def clicks(seconds: float, every_s: float = BEAT_S, first_s: float = 0.25) -> np.ndarray:
    """Short decaying tones."""
    samples, tone = np.zeros((round(seconds * RATE), 2)), np.arange(0, 0.03, 1 / RATE)
    burst = 0.8 * np.exp(-tone / 0.006) * np.sin(2 * np.pi * 1000 * tone)
    for start in np.arange(first_s, seconds - 0.05, every_s):
        at = round(start * RATE)
        samples[at : at + len(burst)] += burst[:, None]
    return samples


def onsets(samples: np.ndarray) -> np.ndarray:
    """Times at which silence ends, seconds."""
    loud = np.abs(samples).max(1) > 0.15
    starts = np.flatnonzero(loud & ~np.roll(loud, 1))
    return starts[np.insert(np.diff(starts) > 0.1 * RATE, 0, True)] / RATE


def test_slowed_clicks_stay_within_20_ms_of_their_pictures() -> None:
    tempo, samples = 0.78, clicks(8.0)
    times = np.arange(0, 8 / tempo, HOP / RATE) * tempo
    heard, said = onsets(warped(samples, times)), onsets(samples) / tempo
    assert len(heard) == len(said)
    assert np.abs(heard - said).max() < 0.02


def test_locally_warped_clicks_stay_within_20_ms_of_their_pictures() -> None:
    samples, result = clicks(8.0), np.arange(0, 9.0, HOP / RATE)
    times = 0.85 * result + 0.12 * np.sin(result)
    heard = onsets(warped(samples, times))
    said = np.interp(onsets(samples), times, result)
    said = said[said < 8.9]
    assert np.abs(heard[: len(said)] - said).max() < 0.02


def test_a_slowed_tone_keeps_its_pitch() -> None:
    seconds = np.arange(4 * RATE) / RATE
    tone = np.repeat(0.5 * np.sin(2 * np.pi * 440 * seconds)[:, None], 2, 1)
    slow = warped(tone, np.arange(0, 4 / 0.78, HOP / RATE) * 0.78)[RATE : 4 * RATE, 0]
    spectrum = np.abs(np.fft.rfft(slow * np.hanning(len(slow))))
    assert abs(np.argmax(spectrum) * RATE / len(slow) - 440) < 3


def test_sound_at_its_own_tempo_is_unchanged() -> None:
    samples = clicks(3.0)
    same = warped(samples, np.arange(0, 3.0, HOP / RATE))
    assert np.abs(same[: len(samples)] - samples[: len(same)]).max() < 1e-6


def test_sound_and_picture_of_a_written_film_are_in_step(tmp_path: Path) -> None:
    sound = Sound(clicks(4.0))
    pictures = [np.full((64, 64, 3), 10, np.uint8)] * (4 * FPS)
    film = write_video(pictures, FPS, tmp_path / "film.mp4", sound=sound)
    found = read_sound(film)
    assert found is not None
    heard, said = onsets(found.samples), onsets(sound.samples)
    assert len(heard) == len(said)
    assert np.abs(heard - said).max() < 0.02


def test_a_film_without_sound_is_silent(tmp_path: Path) -> None:
    pictures = [np.full((64, 64, 3), 10, np.uint8)] * FPS
    assert read_sound(write_video(pictures, FPS, tmp_path / "film.mp4")) is None


def bobbing(seconds: float, shift_s: float = 0.0) -> np.ndarray:
    """Points that stand still for a moment at 0.25 s and every half second after it."""
    times = np.arange(0, seconds, 1 / FPS) - 0.25 - shift_s
    height = 0.1 * np.cos(2 * np.pi * times / (2 * BEAT_S))
    return np.stack([np.zeros_like(times), np.zeros_like(times), height], 1)[:, None]


@pytest.mark.medium
def test_a_motion_on_made_clicks_hits_their_beats_and_a_shifted_one_does_not() -> None:
    music = music_beats(Sound(clicks(12.0)))
    on, off = (alignment(music, motion_beats(bobbing(12.0, s), FPS)) for s in (0.0, 0.25))
    assert on.f1 >= 0.95
    assert off.f1 <= 0.2
    assert on.bas > 0.8 > 0.2 > off.bas
    assert half_a_beat(music) == pytest.approx(0.25, abs=0.02)


def test_the_score_of_hand_worked_beats() -> None:
    found = alignment(np.array([1.0, 2.0, 3.0, 4.0]), np.array([1.05, 2.2, 3.0]))
    assert found.precision == pytest.approx(2 / 3)
    assert found.recall == pytest.approx(0.5)
    assert found.f1 == pytest.approx(4 / 7)
    exact = np.mean(np.exp(-(np.array([0.05, 0.2, 0.0, 1.0]) ** 2) / (2 * 0.05**2)))
    assert found.bas == pytest.approx(exact)
