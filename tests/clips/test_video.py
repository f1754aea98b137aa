"""Laws of reading videos: what is there is reported, what is broken gets one clear line."""

from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from robojackson.clips.pose_detector import track_of
from robojackson.clips.trim import trim
from robojackson.clips.upright_frame import TURNS
from robojackson.clips.video import (
    VideoLimits,
    list_videos,
    probe,
    read_frames,
    timed_frames,
)
from robojackson.errors import (
    RoboJacksonError,
    TrackTooShort,
    TruncatedVideo,
    UnreadableVideo,
    VideoTooLong,
)
from tests.fixtures.bad_clips import damage, write_timed

CLIPS = Path(__file__).parents[2] / "clips"
LIMITS = VideoLimits()
ONE = 1 << 16
"""In the 16.16 numbers of a track header's matrix."""
QUARTER_TURN_CLOCKWISE = (0, ONE, 0, -ONE, 0, 0)


def turn_by_metadata(path: Path, matrix: tuple[int, ...] = QUARTER_TURN_CLOCKWISE) -> None:
    """Write a quarter turn clockwise into the track header's matrix, as a phone does."""
    data = bytearray(path.read_bytes())
    start = data.index(b"tkhd") + 4 + 40
    for index, value in enumerate(matrix):
        data[start + 4 * index : start + 4 * index + 4] = value.to_bytes(4, "big", signed=True)
    path.write_bytes(bytes(data))


def test_probe_returns_what_was_written(write_video) -> None:
    info = probe(write_video(frames=20, size=(64, 48), fps=20), LIMITS)
    assert (info.width, info.height, info.fps, info.frames) == (64, 48, 20.0, 20)
    assert info.duration_s == pytest.approx(1.0)


def test_every_frame_is_read_in_order(write_video) -> None:
    levels = [int(image[:, 40:].mean()) for image in read_frames(write_video(frames=20))]
    assert np.abs(np.array(levels) - 2 * np.arange(20)).max() <= 2


@pytest.mark.parametrize(
    ("file_fps", "read", "step"),
    [(60, 60.0, 1), (90, 45.0, 2), (120, 60.0, 2), (240, 60.0, 4), (480, 60.0, 8)],
)
def test_of_a_fast_file_about_sixty_frames_a_second_are_read(
    write_video, file_fps: int, read: float, step: int
) -> None:
    path = write_video(frames=24, fps=file_fps)
    info, frames = probe(path, LIMITS), list(timed_frames(path))
    assert (info.fps, info.step, info.frames) == (pytest.approx(read), step, 24 // step)
    assert not info.uneven
    levels = [int(image[:, 40:].mean()) for _, image in frames]
    assert np.abs(np.array(levels) - 2 * np.arange(0, 24, step)).max() <= 2
    assert [time for time, _ in frames] == pytest.approx(np.arange(24 // step) / read, abs=1e-3)


def test_the_track_of_a_fast_file_says_how_much_of_it_was_read(write_video) -> None:
    info = probe(write_video(frames=24, fps=240), LIMITS)
    rows = np.zeros((info.frames, 33, 7))
    assert track_of(rows, np.arange(6) / 60, info).notes == ("of 240 frames a second 60 are read",)


def test_frames_have_no_padding_between_rows(write_video) -> None:
    image = next(read_frames(write_video(size=(90, 48))))
    assert image.flags.c_contiguous


@pytest.mark.parametrize("turned", [False, True])
def test_anamorphic_pixels_are_made_square(tmp_path: Path, turned: bool) -> None:
    """A disc is stored narrow, with pixels of 4:3, as HDV stores it."""
    path, disc = tmp_path / "hdv.mp4", np.zeros((96, 96, 3), np.uint8)
    cv2.ellipse(disc, (48, 48), (24, 32), 0, 0, 360, (255, 255, 255), -1)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=20)
        stream.width, stream.height, stream.pix_fmt = 96, 96, "yuv420p"
        stream.codec_context.sample_aspect_ratio = Fraction(4, 3)
        for _ in range(10):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(disc)))
        container.mux(stream.encode(None))
    if turned:
        turn_by_metadata(path)
    info, image = probe(path, LIMITS), next(read_frames(path))
    assert (info.width, info.height) == image.shape[1::-1] == ((96, 128) if turned else (128, 96))
    spans = [np.ptp(np.flatnonzero(image[..., 0].max(axis) > 128)) for axis in (0, 1)]
    assert spans[0] == pytest.approx(spans[1], abs=2)
    small = next(timed_frames(path, short_side=48))[1]
    assert small.shape[1::-1] == ((48, 64) if turned else (64, 48))


@pytest.mark.parametrize("width", [64, 90])
def test_pixels_are_those_that_the_decoder_gives(write_video, width: int) -> None:
    path = write_video(frames=3, size=(width, 48))
    with av.open(str(path)) as container:
        decoded = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert np.array_equal(np.array(list(read_frames(path))), np.array(decoded))


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_each_quarter_turn_is_anticlockwise(quarters: int) -> None:
    image = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)
    assert np.array_equal(cv2.rotate(image, TURNS[quarters]), np.rot90(image, quarters))


def test_rotation_tag_swaps_width_and_height(write_video) -> None:
    path = write_video(size=(64, 48))
    turn_by_metadata(path)
    info = probe(path, LIMITS)
    assert (info.width, info.height, info.rotation) == (48, 64, 90)


def test_rotation_tag_turns_the_bright_left_half_up(write_video) -> None:
    path = write_video(size=(64, 48))
    turn_by_metadata(path)
    image = next(read_frames(path)).astype(int)
    assert image.shape == (64, 48, 3)
    assert image[:30].mean() > image[34:].mean() + 40


@pytest.mark.parametrize("flipped", ["x", "y", "xy", ""])
@pytest.mark.parametrize("transposed", [False, True])
def test_a_picture_is_mirrored_and_turned_as_players_show_it(
    tmp_path: Path, flipped: str, transposed: bool
) -> None:
    """The matrix takes stored pixels (x, y) to (a x + c y, b x + d y), then to positive ones."""
    path, corner = tmp_path / "mirrored.mp4", np.zeros((48, 64, 3), np.uint8)
    corner[:16, :24] = 200
    write_timed(path, [(0.0, corner), (0.1, corner)])
    image = next(read_frames(path))
    x, y = (-ONE if axis in flipped else ONE for axis in "xy")
    turn_by_metadata(path, (0, y, 0, x, 0, 0) if transposed else (x, 0, 0, 0, y, 0))
    shown = image.transpose(1, 0, 2) if transposed else image
    shown = shown[:: -1 if "y" in flipped else 1, :: -1 if "x" in flipped else 1]
    info, read = probe(path, LIMITS), next(read_frames(path))
    assert (info.width, info.height) == read.shape[1::-1]
    assert np.array_equal(read, shown)


def test_text_file_named_mp4_is_not_a_video(tmp_path: Path) -> None:
    path = tmp_path / "notes.mp4"
    path.write_text("this is no video\n" * 50)
    with pytest.raises(UnreadableVideo, match=r"notes\.mp4: not a video"):
        probe(path, LIMITS)


def test_empty_file_is_reported_as_empty(tmp_path: Path) -> None:
    path = tmp_path / "empty.mp4"
    path.touch()
    with pytest.raises(UnreadableVideo, match="empty"):
        probe(path, LIMITS)


def test_missing_file_is_reported_as_missing(tmp_path: Path) -> None:
    with pytest.raises(UnreadableVideo, match="no such file"):
        probe(tmp_path / "nowhere.mp4", LIMITS)


@pytest.mark.parametrize("index_first", [True, False])
def test_half_a_file_is_truncated(write_video, index_first: bool) -> None:
    path = write_video(frames=60, size=(320, 240), index_first=index_first)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(TruncatedVideo, match="copy or download"):
        probe(path, LIMITS)


def test_one_frame_is_too_short(write_video) -> None:
    with pytest.raises(TrackTooShort, match="1 frame"):
        probe(write_video(frames=1), LIMITS)


def test_long_clip_is_refused_with_both_figures(write_video) -> None:
    with pytest.raises(VideoTooLong, match=r"1\.0 s .* 0\.5 s"):
        probe(write_video(frames=20, fps=20), VideoLimits(max_duration_s=0.5))


def test_every_refusal_is_one_line(write_video, tmp_path: Path) -> None:
    path = tmp_path / "notes.mp4"
    path.write_text("no video")
    with pytest.raises(RoboJacksonError) as caught:
        probe(path, LIMITS)
    assert "\n" not in str(caught.value)


def test_range_of_frames_includes_its_start_and_excludes_its_end(write_video) -> None:
    path = write_video(frames=20, fps=20)
    levels = [int(image[:, 40:].mean()) for image in read_frames(path, 0.25, 0.5)]
    assert np.abs(np.array(levels) - [10, 12, 14, 16, 18]).max() <= 2


def test_trim_keeps_exactly_the_range(write_video, tmp_path: Path) -> None:
    out = trim(write_video(frames=20, fps=20), 0.25, 0.75, tmp_path / "part.mp4")
    levels = [int(image[:, 40:].mean()) for image in read_frames(out)]
    assert probe(out, LIMITS).frames == 10
    assert abs(levels[0] - 10) <= 3


@pytest.mark.medium
def test_trim_of_a_damaged_video_keeps_its_times(tmp_path: Path) -> None:
    path = tmp_path / "copy.mp4"
    path.write_bytes((CLIPS / "dance_a.mp4").read_bytes())
    damage(path)
    there = np.array([t for t, _ in timed_frames(path, 0.5, 3.0)])
    out = trim(path, 0.5, 3.0, tmp_path / "part.mp4")
    kept = np.array([t for t, _ in timed_frames(out)])
    assert len(there) < 75  # of 30 a second
    assert kept == pytest.approx(there - there[0], abs=1e-4)


def test_trim_of_nothing_leaves_no_file(write_video, tmp_path: Path) -> None:
    out = tmp_path / "part.mp4"
    with pytest.raises(TrackTooShort):
        trim(write_video(frames=20, fps=20), 5.0, 6.0, out)
    assert list(tmp_path.glob("*.mp4")) == [tmp_path / "clip.mp4"]


def test_folder_lists_its_videos_by_name(write_video, tmp_path: Path) -> None:
    second, first = write_video("b.mp4", frames=2), write_video("a.MOV", frames=2)
    (tmp_path / "readme.txt").write_text("text")
    assert list_videos(tmp_path) == (first, second)


def test_what_is_no_file_in_a_folder_is_left_out(write_video, tmp_path: Path) -> None:
    good = write_video("b.mp4", frames=2)
    (tmp_path / "a.mp4").symlink_to(tmp_path / "gone.mp4")
    (tmp_path / "c.mp4").mkdir()
    assert list_videos(tmp_path) == (good,)


def test_folder_without_videos_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnreadableVideo, match="holds no video"):
        list_videos(tmp_path)


def write_at(path: Path, times: np.ndarray) -> Path:
    """Write a clip whose frame k is grey of level 8 k and shown from times[k] on."""
    pictures = ((t, np.full((48, 64, 3), 8 * k, np.uint8)) for k, t in enumerate(times))
    write_timed(path, pictures)
    return path


UNEVEN_S = np.array([0.0, 0.04, 0.08, 0.12, 0.32, 0.52, 0.72, 0.76, 0.8])


def test_a_varying_rate_is_reported_and_its_mean_is_right(tmp_path: Path) -> None:
    info = probe(write_at(tmp_path / "phone.mp4", UNEVEN_S), LIMITS)
    assert info.uneven
    assert info.fps == pytest.approx(8 / 0.8)


def test_frames_come_at_the_times_at_which_they_were_taken(tmp_path: Path) -> None:
    path = write_at(tmp_path / "phone.mp4", UNEVEN_S)
    assert [t for t, _ in timed_frames(path)] == pytest.approx(UNEVEN_S, abs=1e-4)


def test_a_trimmed_range_keeps_its_varying_rate(tmp_path: Path) -> None:
    path = write_at(tmp_path / "phone.mp4", UNEVEN_S)
    out = trim(path, 0.12, 0.77, tmp_path / "part.mp4")
    assert [t for t, _ in timed_frames(out)] == pytest.approx(UNEVEN_S[3:8] - 0.12, abs=1e-4)


def test_frames_without_times_come_at_the_rate_that_the_file_states(tmp_path: Path) -> None:
    path = tmp_path / "raw.h264"
    with av.open(str(path), "w", format="h264") as container:
        stream = container.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for level in range(12):
            image = np.full((48, 64, 3), 20 * level, np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image)))
        container.mux(stream.encode(None))
    info = probe(path, LIMITS)
    assert [t for t, _ in timed_frames(path)] == pytest.approx(np.arange(12) / info.fps)
    assert not info.uneven


def test_frames_that_are_all_shown_at_once_are_refused(write_video, monkeypatch) -> None:
    path = write_video(frames=12)
    monkeypatch.setattr("robojackson.clips.video.packet_times", lambda path: np.zeros(12))
    with pytest.raises(UnreadableVideo, match="all of its 12 frames are shown at the same time"):
        probe(path, LIMITS)


def test_an_even_clip_is_reported_as_even(write_video) -> None:
    assert not probe(write_video(frames=30, fps=24), LIMITS).uneven


def test_large_pictures_are_made_smaller_on_request(write_video) -> None:
    path = write_video(size=(320, 240))
    shapes = [next(timed_frames(path, short_side=side))[1].shape for side in (120, 999)]
    assert shapes == [(120, 160, 3), (240, 320, 3)]


def test_a_few_damaged_frames_are_left_out_and_the_others_keep_their_times(tmp_path: Path) -> None:
    path = tmp_path / "copy.mp4"
    path.write_bytes((CLIPS / "dance_a.mp4").read_bytes())
    damage(path)
    times = [t for t, _ in timed_frames(path)]
    assert 90 < len(times) < 98
    assert np.array(times) * 30 == pytest.approx(np.round(np.array(times) * 30))
    assert times[-1] == pytest.approx(97 / 30)
