"""The video from end to end, small, and its encoder."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import av
import mujoco
import numpy as np
import pytest

from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video.encoder import write_video
from robojackson.report.video.side_by_side import VideoConfig, side_by_side
from robojackson.report.video.still_picture import MOMENTS, _moments

SMALL = VideoConfig(fps=10, panel_width=64, panel_height=96)


def decoded(path: Path) -> list[np.ndarray]:
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


@pytest.mark.medium
def test_video_shows_four_panels_for_the_whole_rollout(
    clip: Path, track: LandmarkTrack, sequence: SmplSequence, reference: ReferenceMotion,
    model: mujoco.MjModel, tmp_path: Path,
) -> None:  # fmt: skip
    rollout = np.concatenate([reference.qpos, reference.qpos])
    out = side_by_side(
        clip, track, sequence, reference, rollout, tmp_path / "d.mp4", model=model, config=SMALL
    )
    frames = decoded(out)
    assert len(frames) == round(len(rollout) * reference.dt * 10)
    assert frames[0].shape == (96, 4 * 64 + 3 * 2, 3)


@pytest.mark.medium
def test_video_without_a_rollout_has_three_panels(
    clip: Path, track: LandmarkTrack, sequence: SmplSequence, reference: ReferenceMotion,
    model: mujoco.MjModel, tmp_path: Path,
) -> None:  # fmt: skip
    out = side_by_side(
        clip, track, sequence, reference, None, tmp_path / "d.mp4", model=model, config=SMALL
    )
    assert decoded(out)[0].shape[1] == 3 * 64 + 2 * 2


@pytest.mark.medium
@pytest.mark.parametrize(
    ("shape", "size"),
    [("square", (1080, 1080)), ("vertical", (1080, 1920)), ("wide", (1920, 1080))],
)
def test_a_shape_has_its_size_with_the_robot_beside_the_dancer_or_alone(
    shape: Literal["square", "vertical", "wide"], size: tuple[int, int], clip: Path,
    track: LandmarkTrack, sequence: SmplSequence, reference: ReferenceMotion, model: mujoco.MjModel,
    tmp_path: Path,
) -> None:  # fmt: skip
    shown = []
    for alone in (False, True):
        config = VideoConfig(fps=5, max_seconds=0.2, shape=shape, alone=alone)
        out = side_by_side(
            clip, track, sequence, reference, reference.qpos, tmp_path / "d.mp4", model=model,
            config=config,
        )  # fmt: skip
        shown.append(decoded(out)[0])
        assert shown[-1].shape[1::-1] == pytest.approx(size, abs=2)
    corner = [picture[300:400, 20:120].mean() for picture in shown]
    assert abs(corner[0] - corner[1]) > 10


def test_progress_reaches_its_total(
    clip: Path, track: LandmarkTrack, sequence: SmplSequence, reference: ReferenceMotion,
    model: mujoco.MjModel, tmp_path: Path,
) -> None:  # fmt: skip
    calls: list[tuple[int, int]] = []
    side_by_side(
        clip, track, sequence, reference, None, tmp_path / "d.mp4", model=model, config=SMALL,
        progress=lambda done, total: calls.append((done, total)),
    )  # fmt: skip
    assert calls == [(k, 4) for k in range(1, 5)]


def test_frame_in_which_no_one_was_found_is_still_shown(
    clip: Path, track: LandmarkTrack, sequence: SmplSequence, reference: ReferenceMotion,
    model: mujoco.MjModel, tmp_path: Path,
) -> None:  # fmt: skip
    track.landmarks[3] = track.visibility[3, :, None] = np.nan
    out = side_by_side(
        clip, track, sequence, reference, None, tmp_path / "d.mp4", model=model, config=SMALL
    )
    assert decoded(out)[1][50, 30].mean() == pytest.approx(3 * 20, abs=8)


def test_encoded_video_is_h264_in_the_colours_that_browsers_play(tmp_path: Path) -> None:
    path = write_video([np.zeros((32, 48, 3), np.uint8)] * 3, 30, tmp_path / "x.mp4")
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.pix_fmt) == ("h264", "yuv420p")


def test_encoder_keeps_every_picture(tmp_path: Path) -> None:
    pictures = [np.full((32, 48, 3), 10 * k, np.uint8) for k in range(17)]
    frames = decoded(write_video(pictures, 30, tmp_path / "x.mp4"))
    levels = [frame.mean() for frame in frames]
    np.testing.assert_allclose(levels, 10.0 * np.arange(17), atol=3.0)


def test_video_that_fails_half_way_leaves_nothing(tmp_path: Path) -> None:
    def broken() -> Iterator[np.ndarray]:
        yield np.zeros((32, 48, 3), np.uint8)
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        write_video(broken(), 30, tmp_path / "x.mp4")
    assert list(tmp_path.iterdir()) == []


def test_after_damaged_frames_the_pictures_go_on(
    clip: Path, track: LandmarkTrack, sequence: SmplSequence, reference: ReferenceMotion,
    model: mujoco.MjModel, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """The motion has as many frames as the clip has time, the track those that could be read."""
    last = (len(sequence) - 1) / sequence.fps
    slow = dataclasses.replace(reference, source_time_s=np.linspace(0.0, last, len(reference)))
    few = dataclasses.replace(
        track,
        landmarks=track.landmarks[::2],
        world_landmarks=track.world_landmarks[::2],
        visibility=track.visibility[::2],
        time_s=np.arange(0, len(track), 2) / track.fps,
    )
    assert _moments(slow, sequence, MOMENTS).frame.max() > len(few)
    shown: list[int] = []

    def panels(source: Path, track: LandmarkTrack, person: None, frames: np.ndarray, *size: int):
        shown.extend(frames)
        raise InterruptedError

    monkeypatch.setattr("robojackson.report.video.film.SourceClip", panels)
    with pytest.raises(InterruptedError):
        side_by_side(clip, few, sequence, slow, None, clip.parent / "d.mp4", model=model)
    assert max(shown) > len(few)
