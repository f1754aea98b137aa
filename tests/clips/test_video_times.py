"""Frames of containers that say little: their times, and damage at their beginning."""

from pathlib import Path

import av
import numpy as np
import pytest

from robojackson.clips.trim import trim
from robojackson.clips.video import VideoLimits, probe, read_frames, timed_frames
from robojackson.clips.video_container import length_s, rate
from robojackson.errors import UnreadableVideo
from tests.fixtures.bad_clips import write_timed
from tests.fixtures.web_streams import noise_piece

FPS, FRAMES = 30, 40


def written(path: Path, codec: str, pixels: str = "yuv420p", frames: int = FRAMES) -> Path:
    """Write a video whose n-th picture is grey by 5 n."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=FPS)
        stream.width, stream.height, stream.pix_fmt = 160, 120, pixels
        for number in range(frames):
            image = np.full((120, 160, 3), 5 * number % 250, np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
        container.mux(stream.encode(None))
    return path


def harmed(source: Path, path: Path, which: set[int]) -> Path:
    """Copy a video with garbage instead of some of its packets."""
    with av.open(str(source)) as read, av.open(str(path), "w") as made:
        stream = made.add_stream_from_template(read.streams.video[0])
        packets = (packet for packet in read.demux(video=0) if packet.size)
        for number, packet in enumerate(packets):
            kept = packet
            if number in which:
                kept = av.Packet(b"\x11" * packet.size)
                kept.pts, kept.dts, kept.time_base = packet.pts, packet.dts, packet.time_base
            kept.stream = stream
            made.mux(kept)
    return path


def test_pictures_of_an_avi_with_frames_in_between_are_in_order(tmp_path: Path) -> None:
    """AVI has times of the decoding order alone, which the decoder hands out with the pictures."""
    path = written(tmp_path / "a.avi", "libx264")
    found = list(timed_frames(path))
    np.testing.assert_allclose([time_s for time_s, _ in found], np.arange(FRAMES) / FPS, atol=2e-3)
    greys = [image.mean() for _, image in found]
    assert (np.diff(greys) > 2).all()
    cut = tmp_path / "cut.mp4"
    trim(path, 0.2, 1.0, cut)
    assert len(list(read_frames(cut))) == 24


@pytest.mark.parametrize("suffix", [".avi", ".mkv"])
@pytest.mark.parametrize("which", [{0}, {1, 2}, {50, 51, 52}])
def test_a_few_damaged_pictures_are_left_out_wherever_they_are(
    tmp_path: Path, suffix: str, which: set[int]
) -> None:
    whole = written(tmp_path / f"whole{suffix}", "mjpeg", "yuvj420p", 100)
    path = harmed(whole, tmp_path / f"harmed{suffix}", which)
    assert probe(path, VideoLimits()).frames == 100
    times = [time_s for time_s, _ in timed_frames(path)]
    assert len(times) == 100 - len(which)
    assert (np.diff(times) > 0).all()


def test_a_video_without_a_picture_that_can_be_decoded_is_refused(tmp_path: Path) -> None:
    whole = written(tmp_path / "whole.mkv", "mjpeg", "yuvj420p", 10)
    path = harmed(whole, tmp_path / "harmed.mkv", set(range(10)))
    with pytest.raises(UnreadableVideo, match="no frame that can be decoded"):
        probe(path, VideoLimits())


def noise_in_pieces(starts: list[int]) -> bytes:
    """Return joined transport streams of 5 noisy pictures at 5 a second; each knows its start."""
    return b"".join(noise_piece(start, frames=5, rate=5, side=64) for start in starts)


def test_the_seams_of_a_stream_in_pieces_are_no_damage(tmp_path: Path) -> None:
    """Each piece counts its packets from 0, which FFmpeg reports as damage."""
    path = tmp_path / "joined.mp4"
    path.write_bytes(noise_in_pieces([0, 5, 10]))
    found = probe(path, VideoLimits())
    assert (found.frames, found.fps, found.uneven) == (15, pytest.approx(5.0), False)
    times = [time_s for time_s, _ in timed_frames(path)]
    np.testing.assert_allclose(times, np.arange(15) / 5, atol=1e-4)


def test_a_stream_whose_clock_starts_again_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "joined.mp4"
    path.write_bytes(noise_in_pieces([0, 5, 0]))
    with pytest.raises(UnreadableVideo, match=r"starts again after .* several videos"):
        probe(path, VideoLimits())


def paused(after: int, seconds: float, frames: int = 77, fps: float = 30.0) -> np.ndarray:
    """Return timestamps with a pause before one frame."""
    return np.arange(frames) / fps + np.where(np.arange(frames) < after, 0.0, seconds)


@pytest.mark.parametrize("seconds", [2.5, 20.0])
def test_a_pause_does_not_thin_what_was_filmed_around_it(tmp_path: Path, seconds: float) -> None:
    path, times = tmp_path / "paused.mp4", paused(40, seconds)
    write_timed(path, ((t, np.full((48, 64, 3), 3 * k, np.uint8)) for k, t in enumerate(times)))
    found = probe(path, VideoLimits())
    assert (found.frames, found.fps, found.uneven) == (77, pytest.approx(30.0, rel=1e-3), True)
    assert found.duration_s == pytest.approx(77 / 30 + seconds, abs=1e-3)


def test_the_rate_of_frames_that_vary_without_a_pause_is_their_mean() -> None:
    times = np.cumsum(np.random.default_rng(0).choice([0.033, 0.034, 0.067, 0.1], 200))
    times -= times[0]
    assert rate(times, 60.0) == pytest.approx(199 / times[-1])


def test_a_video_whose_pauses_would_fill_millions_of_frames_is_refused() -> None:
    long = paused(40, 10 * 3600.0)
    assert rate(long, 0.0) == pytest.approx(30.0)
    with pytest.raises(UnreadableVideo, match="77 frames in 36003 s"):
        length_s(long, 30.0, Path("night.mp4"))
