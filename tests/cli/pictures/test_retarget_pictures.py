"""`robojackson retarget --video`: the pictures that it leaves beside its tables."""

from pathlib import Path

import av
import pytest

from robojackson.cli.pictures.retarget_pictures import draw_retargeting
from robojackson.errors import StoreError
from robojackson.files import tables
from tests.fixtures.commands import robojackson
from tests.fixtures.robots import human, robot_motion

pytestmark = pytest.mark.medium

TINY = {"render.max_seconds": 0.3, "render.panel_width": 96, "render.panel_height": 128}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return the hip shake, as `robojackson retarget` leaves it."""
    (tmp_path / "smpl.parquet").write_bytes(tables.encode(human("hip_shake")))
    (tmp_path / "reference.parquet").write_bytes(tables.encode(robot_motion("hip_shake")))
    return tmp_path


def test_the_video_has_two_panels_and_the_requested_length(folder: Path) -> None:
    result = draw_retargeting(folder / "smpl.parquet", folder, "base", TINY)
    with av.open(result["video"]) as container:
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert (len(frames), frames[0].shape) == (9, (128, 2 * 96 + 2, 3))


def test_both_plots_are_pictures(folder: Path) -> None:
    result = draw_retargeting(folder / "smpl.parquet", folder, "base", TINY)
    heads = [Path(result[name]).read_bytes()[:4] for name in ("contacts", "torques")]
    assert heads == [b"\x89PNG"] * 2


def test_a_motion_that_is_not_there_is_reported(folder: Path) -> None:
    (folder / "reference.parquet").unlink()
    with pytest.raises(StoreError, match="no such file"):
        draw_retargeting(folder / "smpl.parquet", folder, "base", TINY)


def test_the_command_draws_on_request(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = robojackson(
        *("retarget", folder / "smpl.parquet", "-o", out, "--video", "--config=smoke", "--json")
    )
    drawn = {name: Path(result.answer[name]).exists() for name in ("video", "contacts", "torques")}
    assert drawn == {"video": True, "contacts": True, "torques": True}
    assert not result.loaded_prefect
