"""FFmpeg opens the file that is named, whatever it is called, and no other."""

import shutil
from pathlib import Path

import pytest

from robojackson.clips import video_container
from robojackson.clips.video import VideoLimits, probe
from robojackson.errors import UnreadableVideo
from tests.fixtures.crossing import CLIPS

CLIP = CLIPS / "hip_shake.mp4"
COLONS = ("Dance: hip.mp4", "12:30.mp4", "data:x.mp4", "concat:a|b.mp4", "pipe:0", "%03d.mp4")


@pytest.mark.parametrize("name", COLONS)
def test_a_name_is_no_protocol(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy(CLIP, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    assert probe(Path(name), VideoLimits()).frames == 120


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.m3u8", "#EXTM3U\n#EXTINF:9,\nfile://{clip}\n", "HLS"),
        ("a.mp4", "ffconcat version 1.0\nfile {clip}\n", "concat"),
        ("a.mpd", '<?xml version="1.0"?><MPD/>', "DASH"),
        ("a.sdp", "v=0\nm=video 5004 RTP/AVP 96\n", "SDP"),
    ],
)
def test_what_names_other_files_is_refused(
    name: str, text: str, message: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text.format(clip=CLIP))
    with pytest.raises(UnreadableVideo, match=message):
        probe(tmp_path / name, VideoLimits())


def test_a_picture_beyond_the_limit_is_not_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(video_container, "MOST_PIXELS", 100)
    with pytest.raises(UnreadableVideo, match="pixels; at most 100"):
        probe(CLIP, VideoLimits())


def test_a_video_of_too_many_frames_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(video_container, "MOST_FRAMES", 50)
    with pytest.raises(UnreadableVideo, match="more than 50 frames"):
        probe(CLIP, VideoLimits())
