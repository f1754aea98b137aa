"""Pictures of a clip are the same whatever is held of them, and what is held is limited."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from robojackson.clips.video import read_frames
from robojackson.report.video import canvas
from robojackson.report.video.clip_pictures import ClipPictures
from tests.report.conftest import FRAMES

SIZE = (48, 32)
CUT = partial(canvas.cut, box=(8, 4, 72, 48), size=SIZE)
PICTURE_BYTES = SIZE[0] * SIZE[1] * 3


@pytest.mark.parametrize("held", [0, 1, 3, FRAMES])
@pytest.mark.parametrize(
    "rows",
    [
        list(range(FRAMES)),
        [2, 2, 5, 5, 9],
        [4, 5, 6, 7, 8] * 3,
        [9, 1, 11, 0],
    ],
    ids=["in order", "some", "a cycle", "any order"],
)
def test_pictures_are_those_of_the_clip_however_few_are_held(
    clip: Path, rows: list[int], held: int
) -> None:
    pictures = ClipPictures(clip, rows, CUT, held * PICTURE_BYTES)
    expected = [CUT(frame) for frame in read_frames(clip)]
    for row in rows:
        np.testing.assert_array_equal(pictures.at(row), expected[row])
        assert pictures.held_bytes <= max(1, held) * PICTURE_BYTES


def test_beyond_the_end_of_a_clip_there_is_no_picture(clip: Path) -> None:
    pictures = ClipPictures(clip, [3, FRAMES + 2], CUT)
    assert pictures.at(FRAMES + 2) is None
    assert pictures.at(3) is not None
    assert pictures.at(FRAMES + 2) is None
