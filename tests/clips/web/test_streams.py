"""Streams of pieces (HLS): whole or not at all, and no external program."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from yt_dlp.aes import aes_cbc_encrypt_bytes

from robojackson.clips.video_container import packet_times
from robojackson.clips.web.download_formats import FormatConfig
from robojackson.clips.web.yt_dlp_client import fetch, offer
from robojackson.errors import DownloadFailed
from tests.fixtures.web_server import PATIENT, Web
from tests.fixtures.web_streams import noise_piece

PIECES, FRAMES, RATE = 3, 5, 5


@pytest.fixture
def streaming(web: Web) -> Web:
    """Return a running server with a stream of three pieces."""
    web.pieces = [noise_piece(FRAMES * n, FRAMES, RATE, side=32) for n in range(PIECES)]
    return web


@pytest.fixture
def started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a file that is written where an external program on the path is started."""
    programs, started = tmp_path / "programs", tmp_path / "started"
    programs.mkdir()
    for name in ("ffmpeg", "ffprobe", "rtmpdump"):
        (programs / name).write_text(f"#!/bin/sh\necho ffmpeg version 7.1; echo $@ >> {started}\n")
        (programs / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{programs}:/usr/bin:/bin")
    return started


def get(web: Web, path: str, folder: Path) -> Path:
    chosen = offer(f"{web.url}/{path}", "score", FormatConfig(), PATIENT)
    assert chosen.info["protocol"] == "m3u8_native"
    return fetch(chosen, folder, PATIENT)


def test_a_stream_arrives_with_every_frame(streaming: Web, started: Path, tmp_path: Path) -> None:
    path = get(streaming, "hls/clip.m3u8", tmp_path)
    assert path.read_bytes() == b"".join(streaming.pieces)
    np.testing.assert_allclose(packet_times(path), np.arange(PIECES * FRAMES) / RATE, atol=1e-4)
    assert not started.exists()


def test_a_stream_with_a_missing_piece_is_no_video(streaming: Web, tmp_path: Path) -> None:
    with pytest.raises(DownloadFailed) as failure:
        get(streaming, "hls-gap/clip.m3u8", tmp_path)
    assert str(failure.value) == "a piece of the video: HTTP 404 not found"
    assert streaming.times("/missing/1.ts") == 1


@pytest.mark.medium
@pytest.mark.parametrize("fault", ["broken", "busy", "half", "reset_midway", "cut_chunk"])
def test_a_piece_that_failed_once_is_made_again(streaming: Web, fault: str, tmp_path: Path) -> None:
    """Of the download, the playlist and the first piece are answered well, the second is not."""
    chosen = offer(f"{streaming.url}/hls/clip.m3u8", "score", FormatConfig(), PATIENT)
    streaming.faults = ["hls", "piece", fault]
    assert fetch(chosen, tmp_path, PATIENT).read_bytes() == b"".join(streaming.pieces)
    assert streaming.times("/piece/0.ts") == 1


def test_a_stream_beyond_the_limit_is_not_downloaded(streaming: Web, tmp_path: Path) -> None:
    """Each piece is smaller than the limit, two of them are not."""
    largest = 1.5 * max(len(piece) for piece in streaming.pieces) / 1e6
    chosen = offer(f"{streaming.url}/hls/clip.m3u8", "score", FormatConfig(), PATIENT)
    with pytest.raises(DownloadFailed, match=r"^larger than 0\.0\d* MB$"):
        fetch(chosen, tmp_path, replace(PATIENT, largest_file_mb=largest))
    assert streaming.times("/piece/2.ts") == 0


def test_a_stream_for_an_external_program_is_refused_in_a_plain_line(
    streaming: Web, started: Path, tmp_path: Path
) -> None:
    with pytest.raises(
        DownloadFailed, match=r"external program .* choose another video"
    ) as failure:
        get(streaming, "hls-sample/clip.m3u8", tmp_path)
    assert "install" not in str(failure.value).lower()
    assert not started.exists()
    assert not [path for path, _ in streaming.requests if path.startswith(("/piece", "/key"))]


def test_a_stream_with_the_usual_encryption_is_decrypted_here(
    streaming: Web, started: Path, tmp_path: Path
) -> None:
    """The numbering of the pieces, from 0, is the start of the cipher (RFC 8216, 5.2)."""
    plain = streaming.pieces[0]
    streaming.pieces[0] = bytes(aes_cbc_encrypt_bytes(plain, streaming.video[:16], bytes(16)))
    assert get(streaming, "hls-aes/clip.m3u8", tmp_path).read_bytes() == plain
    assert not started.exists()


def test_a_format_for_an_external_program_is_not_chosen(started: Path) -> None:
    with pytest.raises(DownloadFailed, match="no format with a picture that can be downloaded"):
        offer("rtmp://127.0.0.1:9/live/clip.flv", "score", FormatConfig(), PATIENT)
    assert not started.exists()
