"""Sound: read from a clip, slowed with its pitch and at its pictures, and its beats."""

from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import av
import numpy as np
import pytest

from robojackson.clips.sound import (
    RATE,
    Sound,
    encode_sound,
    music_beats,
    read_sound,
    require_sound,
)
from robojackson.clips.trim import trim
from robojackson.clips.video import timed_frames
from robojackson.errors import UnreadableVideo
from robojackson.metrics.beat_alignment import alignment, half_a_beat, motion_beats
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.report.video.encoder import write_video
from robojackson.report.video.soundtrack import HOP, clip_times, soundtrack, warped

BEAT_S, FPS = 0.5, 30


def clicks(seconds: float, every_s: float = BEAT_S, first_s: float = 0.25) -> np.ndarray:
    """Return short decaying tones."""
    samples, tone = np.zeros((round(seconds * RATE), 2)), np.arange(0, 0.03, 1 / RATE)
    burst = 0.8 * np.exp(-tone / 0.006) * np.sin(2 * np.pi * 1000 * tone)
    for start in np.arange(first_s, seconds - 0.05, every_s):
        at = round(start * RATE)
        samples[at : at + len(burst)] += burst[:, None]
    return samples


def onsets(samples: np.ndarray) -> np.ndarray:
    """Return the times at which silence ends, seconds."""
    loud = np.abs(samples).max(1) > 0.15
    starts = np.flatnonzero(loud & ~np.roll(loud, 1))
    return starts[np.insert(np.diff(starts) > 0.1 * RATE, 0, True)] / RATE


def test_slowed_clicks_stay_within_20_ms_of_their_pictures() -> None:
    tempo, samples = 0.78, clicks(8.0)
    times = np.arange(0, 8 / tempo, HOP / RATE) * tempo
    heard, expected = onsets(warped(samples, times)), onsets(samples) / tempo
    assert len(heard) == len(expected)
    assert np.abs(heard - expected).max() < 0.02


def test_locally_warped_clicks_stay_within_20_ms_of_their_pictures() -> None:
    samples, result = clicks(8.0), np.arange(0, 9.0, HOP / RATE)
    times = 0.85 * result + 0.12 * np.sin(result)
    heard = onsets(warped(samples, times))
    answer = np.interp(onsets(samples), times, result)
    answer = answer[answer < 8.9]
    assert np.abs(heard[: len(answer)] - answer).max() < 0.02


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


def test_a_dance_that_ends_standing_ends_in_silence() -> None:
    tone = np.repeat(np.sin(2 * np.pi * 440 * np.arange(2 * RATE) / RATE)[:, None], 2, 1)
    heard = warped(tone, np.minimum(np.arange(0, 5.0, HOP / RATE), 1.9))
    assert np.abs(heard[round(2.1 * RATE) :]).max() == 0.0
    assert np.abs(heard[: round(1.5 * RATE)]).max() > 0.5


def test_sound_and_picture_of_a_written_film_are_in_step(tmp_path: Path) -> None:
    sound = Sound(clicks(4.0))
    pictures = [np.full((64, 64, 3), 10, np.uint8)] * (4 * FPS)
    film = write_video(pictures, FPS, tmp_path / "film.mp4", sound=sound)
    found = read_sound(film)
    assert found is not None
    heard, expected = onsets(found.samples), onsets(sound.samples)
    assert len(heard) == len(expected)
    assert np.abs(heard - expected).max() < 0.02


def clip_of(samples: np.ndarray, seconds: float, folder: Path) -> Path:
    """Return a clip whose picture flashes while a click begins."""
    starts = onsets(samples)
    pictures = [
        np.full((64, 64, 3), 250 if (np.abs(starts - k / FPS) < 0.5 / FPS).any() else 10, np.uint8)
        for k in range(round(seconds * FPS))
    ]
    return write_video(pictures, FPS, folder / "clip.mp4", sound=Sound(samples))


def flashes(film: Path) -> np.ndarray:
    """Return the times of the pictures that flash, seconds."""
    bright = np.array([frame.mean() > 120 for _, frame in timed_frames(film, 0.0, 1e3)])
    times = np.array([time for time, _ in timed_frames(film, 0.0, 1e3)])
    return times[bright]


def test_a_trimmed_clip_keeps_its_sound_in_step(tmp_path: Path) -> None:
    film = trim(clip_of(clicks(6.0), 6.0, tmp_path), 2.1, 5.0, tmp_path / "part.mp4")
    found = read_sound(film)
    assert found is not None
    heard = onsets(found.samples)
    assert heard == pytest.approx(np.arange(2.25, 5.0, BEAT_S) - 2.1, abs=0.02)
    assert flashes(film) == pytest.approx(heard, abs=0.02 + 0.5 / FPS)


def test_a_range_after_the_end_of_the_sound_is_silent(tmp_path: Path) -> None:
    clip = clip_of(clicks(1.0), 4.0, tmp_path)
    assert read_sound(trim(clip, 2.0, 3.5, tmp_path / "part.mp4")) is None
    part = read_sound(trim(clip, 0.5, 3.5, tmp_path / "part.mp4"))
    assert part is not None
    assert onsets(part.samples) == pytest.approx([0.25], abs=0.02)
    assert len(part.samples) / RATE == pytest.approx(3.0, abs=0.05)


def test_sound_is_read_from_where_it_is_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However long the video is before."""
    clip = clip_of(clicks(6.0), 6.0, tmp_path)
    monkeypatch.setattr("robojackson.clips.sound.LONGEST_S", 2.0)
    part = read_sound(clip, 3.1)
    assert part is not None
    assert onsets(part.samples)[:3] == pytest.approx([0.15, 0.65, 1.15], abs=0.02)


def test_trimming_a_silent_clip_leaves_it_silent(tmp_path: Path) -> None:
    pictures = [np.full((64, 64, 3), 10, np.uint8)] * (2 * FPS)
    clip = write_video(pictures, FPS, tmp_path / "clip.mp4")
    assert read_sound(trim(clip, 0.5, 1.5, tmp_path / "part.mp4")) is None


@pytest.mark.parametrize("tempo", [1.0, 0.78])
def test_sound_and_picture_of_a_slowed_dance_are_in_step(tempo: float, tmp_path: Path) -> None:
    """A motion at a tempo of the clip: its film's pictures flash when its sound clicks."""
    clip = clip_of(clicks(6.0), 6.0, tmp_path)
    steps, dt = round(5.0 / tempo / 0.015), 0.015
    motion = SimpleNamespace(dt=dt, cyclic=False, source_time_s=np.arange(steps) * dt * tempo)
    seconds = steps * dt
    sound = soundtrack(clip, "", cast(ReferenceMotion, motion), seconds)
    assert sound is not None
    shown = clip_times(cast(ReferenceMotion, motion), np.arange(0, seconds, 1 / FPS))
    source = [frame for _, frame in timed_frames(clip, 0.0, 1e3)]
    pictures = [source[min(round(t * FPS), len(source) - 1)] for t in shown]
    film = write_video(pictures, FPS, tmp_path / "film.mp4", sound=sound)
    heard = onsets(require_sound(film).samples)
    answer = np.arange(0.25, 5.0, BEAT_S) / tempo
    assert heard[: len(answer)] == pytest.approx(answer, abs=0.02)
    first = flashes(film)
    first = first[np.insert(np.diff(first) > 2 / FPS, 0, True)]
    assert first[: len(answer)] == pytest.approx(heard[: len(answer)], abs=0.02 + 1 / FPS)


def test_other_music_is_heard_in_place_of_the_clips_own(tmp_path: Path) -> None:
    clip = clip_of(clicks(4.0), 4.0, tmp_path)
    every = write_video(
        [np.zeros((64, 64, 3), np.uint8)] * FPS, FPS, tmp_path / "music.mp4",
        sound=Sound(clicks(8.0, 0.8, 0.4)),
    )  # fmt: skip
    found = soundtrack(clip, str(every), None, 4.0)
    assert found is not None
    assert onsets(found.samples) == pytest.approx(np.arange(0.4, 3.9, 0.8), abs=0.02)


@pytest.mark.parametrize(
    ("suffix", "codec"),
    [("wav", "pcm_s16le"), ("mp3", "libmp3lame"), ("flac", "flac"),
     ("m4a", "aac")],
)  # fmt: skip
def test_music_is_read_from_the_usual_files(suffix: str, codec: str, tmp_path: Path) -> None:
    file = tmp_path / f"music.{suffix}"
    with av.open(str(file), "w") as container:
        stream = container.add_stream(codec, rate=RATE, layout="stereo")
        encode_sound(container, stream, Sound(clicks(3.0)))
    assert onsets(require_sound(file).samples) == pytest.approx(np.arange(0.25, 2.9, 0.5), abs=0.06)


def test_a_playlist_is_no_music(tmp_path: Path) -> None:
    (tmp_path / "list.m3u8").write_text("#EXTM3U\nfile:///etc/passwd\n")
    with pytest.raises(UnreadableVideo, match="names other files"):
        require_sound(tmp_path / "list.m3u8")


def _tone(path: Path, rate: int, begins_s: float = 0.0) -> Path:
    """Return a second of a tone in a file with one picture at its beginning."""
    with av.open(str(path), "w") as container:
        picture = container.add_stream("mjpeg", rate=FPS)
        picture.width, picture.height, picture.pix_fmt = 16, 16, "yuvj420p"
        stream = container.add_stream("pcm_s16le", rate=rate, layout="mono")
        container.mux(picture.encode(av.VideoFrame(16, 16, "yuvj420p")))
        tone = (9000 * np.sin(np.arange(rate))).astype(np.int16)[None]
        frame = av.AudioFrame.from_ndarray(tone, format="s16", layout="mono")
        frame.sample_rate = rate
        for packet in stream.encode(frame):
            packet.pts = packet.dts = round(begins_s * rate)
            packet.time_base = Fraction(1, rate)
            container.mux(packet)
    return path


def test_a_sound_that_begins_hours_late_is_not_filled_with_silence(tmp_path: Path) -> None:
    found = read_sound(_tone(tmp_path / "a.mkv", 8000, begins_s=2.0))
    assert found is not None
    assert len(found.samples) == pytest.approx(3 * RATE, abs=0.1 * RATE)
    assert read_sound(_tone(tmp_path / "b.mkv", 8000, begins_s=20_000.0)) is None


def test_a_rate_of_a_few_samples_a_second_is_no_sound(tmp_path: Path) -> None:
    assert read_sound(_tone(tmp_path / "a.mkv", 4)) is None


def test_music_without_sound_is_refused(tmp_path: Path) -> None:
    silent = write_video([np.zeros((64, 64, 3), np.uint8)] * FPS, FPS, tmp_path / "silent.mp4")
    with pytest.raises(UnreadableVideo, match="no sound that can be heard"):
        soundtrack(None, str(silent), None, 2.0)


def test_a_film_without_sound_is_silent(tmp_path: Path) -> None:
    pictures = [np.full((64, 64, 3), 10, np.uint8)] * FPS
    assert read_sound(write_video(pictures, FPS, tmp_path / "film.mp4")) is None


def bobbing(seconds: float, shift_s: float = 0.0) -> np.ndarray:
    """Return points that stand still for a moment at 0.25 s and every half second after it."""
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
