"""A file of another kind is named by what it is, by its content alone."""

import io
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest
from safetensors.numpy import save

from robojackson.clips.video import VideoLimits, probe
from robojackson.errors import BadTable, UnreadableVideo
from robojackson.files.file_kinds import NETWORKS, SOUND, TABLE, kind_of
from robojackson.files.table_door import column_names


def parquet() -> bytes:
    held = io.BytesIO()
    pd.DataFrame({"x": [1.0]}).to_parquet(held)
    return held.getvalue()


def picture(suffix: str) -> bytes:
    return cv2.imencode(suffix, np.zeros((8, 8, 3), np.uint8))[1].tobytes()


FILES = {
    "png": (picture(".png"), "a picture"),
    "jpg": (picture(".jpg"), "a picture"),
    "bmp": (picture(".bmp"), "a picture"),
    "webp": (picture(".webp"), "a picture"),
    "parquet": (parquet(), TABLE),
    "wav": (b"RIFF\x24\0\0\0WAVEfmt ", SOUND),
    "mp3": (b"ID3\x04\0\0\0", SOUND),
    "safetensors": (save({"layer": np.zeros((300, 2))}), NETWORKS),
    "json": (b'{"a": 1}', "JSON"),
    "text": (b"hello", ""),
    "video": (b"\0\0\0\x20ftypisom", ""),
    "empty": (b"", ""),
}


@pytest.mark.parametrize("name", FILES)
def test_a_kind_is_known_by_the_first_bytes(name: str) -> None:
    data, kind = FILES[name]
    assert kind_of(data) == kind


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("safetensors", "the policy comes first: `robojackson evaluate POLICY REFERENCE`"),
        ("json", "JSON, not a table"),
    ],
)
def test_a_table_that_is_something_else_is_refused_by_what_it_is(name: str, words: str) -> None:
    with pytest.raises(BadTable, match=words):
        column_names(FILES[name][0], "x")


@pytest.mark.parametrize("name", ["png", "parquet", "safetensors", "json"])
def test_a_video_that_is_something_else_is_refused_by_what_it_is(name: str, tmp_path: Path) -> None:
    data, kind = FILES[name]
    path = tmp_path / "clip.mp4"
    path.write_bytes(data)
    with pytest.raises(UnreadableVideo) as refused:
        probe(path, VideoLimits())
    assert kind in str(refused.value)


def test_an_address_is_named_as_one() -> None:
    with pytest.raises(UnreadableVideo, match="an address, expected a file"):
        probe(Path("https://example.org/x.mp4"), VideoLimits())
