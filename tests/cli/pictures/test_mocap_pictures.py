"""`robojackson mocap` and `retarget` leave a picture beside their result, and a film on request."""

import os
import shutil
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from robojackson.cli.pictures.motion_source import source_of
from robojackson.report.video import canvas
from tests.fixtures.commands import Said, in_process

pytestmark = [pytest.mark.medium, pytest.mark.xdist_group("mocap_pictures")]

WIDTH, HEIGHT = 96, 128
TINY = (
    *("--config", "smoke", "--set", "render.max_seconds=0.3"),
    *("--set", f"render.panel_width={WIDTH}", "--set", f"render.panel_height={HEIGHT}"),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("pictures")


@pytest.fixture(scope="module")
def clip(short_clip: Path, folder: Path) -> Path:
    return Path(shutil.copy(short_clip, folder / "clip.mp4"))


@pytest.fixture(scope="module")
def captured(clip: Path, folder: Path) -> Said:
    return in_process("mocap", clip, "-o", folder, "--video", *TINY)


@pytest.fixture(scope="module")
def retargeted(captured: Said, folder: Path) -> Said:
    return in_process("retarget", folder / "smpl.parquet", "-o", folder, "--video", *TINY)


def panels_of(film: Path) -> list[np.ndarray]:
    """Return the panels of the first picture of a film."""
    with av.open(str(film)) as container:
        first = next(container.decode(video=0)).to_ndarray(format="rgb24")
    assert first.shape[0] == HEIGHT
    return [first[:, left : left + WIDTH] for left in range(0, first.shape[1], WIDTH + 2)]


def has_skeleton(picture: np.ndarray) -> bool:
    colours = np.array([canvas.LEFT, canvas.RIGHT])
    apart = np.abs(picture.reshape(-1, 1, 3).astype(int) - colours).max(-1)
    return bool((apart < 60).any(0).all())


def test_mocap_names_its_picture(captured: Said, folder: Path) -> None:
    assert captured.code == 0, captured.err
    assert f"picture   {folder / 'mocap.png'}" in captured.out.splitlines()


def test_the_picture_shows_the_skeleton_over_the_source_and_from_two_sides(
    captured: Said, folder: Path
) -> None:
    sheet = cv2.imread(str(folder / "mocap.png"))[..., ::-1]
    rows = np.array_split(sheet, 3)
    assert all(has_skeleton(row) for row in rows)
    assert rows[0].mean() > 2 * rows[1].mean()


def test_the_film_of_mocap_has_the_source_the_skeleton_over_it_and_the_body(
    captured: Said, folder: Path
) -> None:
    source, over, *body = panels_of(folder / "mocap.mp4")
    assert not has_skeleton(source)
    assert has_skeleton(over)
    assert [has_skeleton(panel) for panel in body] == [True, True]


def test_mocap_without_video_writes_no_film(short_clip: Path, tmp_path: Path) -> None:
    result = in_process("mocap", short_clip, "-o", tmp_path, "--config", "smoke")
    assert result.code == 0, result.err
    assert (tmp_path / "mocap.png").is_file()
    assert not (tmp_path / "mocap.mp4").exists()


def test_a_clip_of_one_second_is_advised_to_be_longer(captured: Said) -> None:
    assert "advice    1.0 s long: film at least 2 s" in captured.out.splitlines()


def test_retarget_names_its_picture(retargeted: Said, folder: Path) -> None:
    assert retargeted.code == 0, retargeted.err
    assert f"picture                   {folder / 'retarget.png'}" in retargeted.out.splitlines()
    assert cv2.imread(str(folder / "retarget.png")).std() > 5


def test_retarget_knows_the_clip_that_mocap_looked_at(
    retargeted: Said, clip: Path, folder: Path
) -> None:
    found = source_of(folder / "smpl.parquet")
    assert found is not None
    assert found.video == clip


def test_the_film_of_retarget_begins_with_the_source(retargeted: Said, folder: Path) -> None:
    source, over, person, robot = panels_of(folder / "retarget.mp4")
    shown = [has_skeleton(panel) for panel in (source, over, person, robot)]
    assert shown == [False, True, True, False]


@pytest.mark.parametrize("name", ["clip.mp4", "landmarks.parquet", "smpl.parquet"])
def test_a_clip_that_is_another_one_by_now_is_not_shown(
    name: str, retargeted: Said, folder: Path, tmp_path: Path
) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    record = copy / "source.json"
    record.write_text(record.read_text().replace(str(folder), str(copy)))
    assert source_of(copy / "smpl.parquet") is not None
    (copy / name).write_bytes(b"another")
    assert source_of(copy / "smpl.parquet") is None


def test_a_motion_without_a_record_of_its_clip_has_none(tmp_path: Path) -> None:
    assert source_of(tmp_path / "smpl.parquet") is None


def test_a_source_that_cannot_be_read_is_none(tmp_path: Path) -> None:
    (tmp_path / "source.json").write_text("[" * 100_000)
    assert source_of(tmp_path / "smpl.parquet") is None
    (tmp_path / "source.json").unlink()
    os.mkfifo(tmp_path / "source.json")
    assert source_of(tmp_path / "smpl.parquet") is None
