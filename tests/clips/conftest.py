"""Small videos written by the tests."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

Writer = Callable[..., Path]


@pytest.fixture
def write_video(tmp_path: Path) -> Writer:
    """Return write_video(name, frames, size, fps, index_first), which returns the path of an H.264
    mp4.

    Frame k is grey of level 2 k; its left half is 60 brighter, so that its orientation shows.
    """

    def write(
        name: str = "clip.mp4",
        frames: int = 20,
        size: tuple[int, int] = (64, 48),
        fps: int = 20,
        index_first: bool = False,
    ) -> Path:
        path = tmp_path / name
        options = {"movflags": "faststart"} if index_first else {}
        width, height = size
        with av.open(str(path), "w", format="mp4", options=options) as container:
            stream = container.add_stream("libx264", rate=Fraction(fps), options={"crf": "10"})
            stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
            for index in range(frames):
                image = np.full((height, width, 3), 2 * index, np.uint8)
                image[:, : width // 2] += 60
                container.mux(stream.encode(av.VideoFrame.from_ndarray(image)))
            container.mux(stream.encode(None))
        return path

    return write
