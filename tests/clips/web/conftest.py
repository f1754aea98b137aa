"""A small video on a server of our own."""

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from tests.fixtures.web_server import Web, serving


@pytest.fixture(scope="session")
def small_video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a second of coloured noise: large enough to be cut in half, small enough to send
    often."""
    path = tmp_path_factory.mktemp("video") / "clip.mp4"
    rng = np.random.default_rng(0)
    with av.open(str(path), "w", format="mp4", options={"movflags": "faststart"}) as container:
        stream = container.add_stream("libx264", rate=Fraction(20), options={"crf": "20"})
        stream.width, stream.height, stream.pix_fmt = 96, 128, "yuv420p"
        for _ in range(20):
            image = rng.integers(0, 255, (128, 96, 3), dtype=np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image)))
        container.mux(stream.encode(None))
    return path


@pytest.fixture
def web(small_video: Path) -> Iterator[Web]:
    """Yield a running server with the small video."""
    with serving(small_video.read_bytes()) as running:
        yield running
