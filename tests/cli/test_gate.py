"""`robojackson retarget` refuses what training could not follow, keeps it; --force goes on."""

from pathlib import Path

import pytest

from robojackson.files import tables
from tests.fixtures.commands import in_process
from tests.fixtures.robots import human

SMOKE = ("--config", "smoke", "--json")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a walk, as `robojackson mocap` leaves it."""
    out = tmp_path_factory.mktemp("gate")
    (out / "smpl.parquet").write_bytes(tables.encode(human("walk")))
    return out


@pytest.mark.medium
def test_a_bad_motion_is_refused_in_one_line_and_kept(folder: Path, tmp_path: Path) -> None:
    result = in_process(
        *("retarget", folder / "smpl.parquet", "-o", tmp_path, "--method", "paper", *SMOKE)
    )
    (line,) = [line for line in result.err.splitlines() if "reference refused" in line]
    assert result.code == 1
    assert "--force" in line
    assert str(tmp_path) in line
    assert (tmp_path / "reference.parquet").exists()


@pytest.mark.medium
def test_force_goes_on_with_it(folder: Path, tmp_path: Path) -> None:
    words = ("retarget", folder / "smpl.parquet", "-o", tmp_path, "--method", "paper")
    result = in_process(*words, "--force", *SMOKE)
    assert result.code == 0
    assert result.answer["scorecard"]["passed"] == 0.0
    assert result.answer["scorecard"]["findings"]
