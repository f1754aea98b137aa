"""`robojackson evaluate NAME REFERENCE`: a tracker by its name, in the table of policies."""

from pathlib import Path

import numpy as np
import pytest

from robojackson.cli.stages import verdict_lines
from robojackson.cli.trackers.named_tracker import is_tracker
from robojackson.cli.trackers.tracker_files import add_tracker
from robojackson.errors import UnknownName
from robojackson.files import tables
from robojackson.pipeline.table_schemas import EVALUATION_RECORD
from tests.fixtures.commands import robojackson
from tests.fixtures.robots import robot_motion
from tests.fixtures.stand_in_tracker import NAME, stand_in, write_yaml

SHORT = ("--set", "evaluate.phases=1", "--set", "evaluate.resets=1", "--seconds", "0.2")


@pytest.fixture
def reference(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a motion of the humanoid, and the stand-in in the store."""
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "store"))
    monkeypatch.setenv("ROBOJACKSON_CONFIGS", str(tmp_path / "configs"))
    file, description = stand_in(tmp_path)
    write_yaml(description, tmp_path / "configs")
    add_tracker(NAME, file)
    path = tmp_path / "reference.parquet"
    path.write_bytes(robot_motion("hip_shake").to_bytes())
    return path


@pytest.mark.slow
def test_a_tracker_is_a_row_of_the_table_under_its_name(reference: Path, tmp_path: Path) -> None:
    result = robojackson("evaluate", NAME, reference, "-o", tmp_path / "out", *SHORT)
    assert result.code == 0, result.err
    assert result.out.splitlines()[1].startswith(NAME)
    table = tmp_path / "out" / "evaluations.parquet"
    rows = tables.decode_rows(EVALUATION_RECORD, table.read_bytes(), str(table))
    own = [row for row in rows if row["policy"] == "trained"]
    assert {(row["setup"], row["seed"]) for row in own} == {(NAME, 0)}
    assert np.isfinite([row["site_error_m"] for row in own]).all()


@pytest.mark.slow
def test_twist2_refuses_a_motion_of_the_humanoid_or_says_how_to_get_it(reference: Path) -> None:
    result = robojackson("evaluate", "twist2", reference, *SHORT)
    assert (result.code, result.out) == (1, "")
    assert "run: robojackson trackers add twist2" in result.err


@pytest.mark.slow
def test_what_is_neither_file_nor_tracker_is_one_line(reference: Path) -> None:
    result = robojackson("evaluate", "twist3", reference)
    assert result.code == 1
    assert "UnknownName: unknown tracker 'twist3' (nor is it a file). Known: " in result.err
    assert "Traceback" not in result.err


def test_a_name_of_no_tracker_and_no_file_lists_the_trackers() -> None:
    with pytest.raises(UnknownName, match=r"'regulater' \(nor is it a file\)\. Known:.*regulator"):
        is_tracker(Path("regulater"))
    assert is_tracker(Path("regulator"))
    assert not is_tracker(Path("runs/regulator"))
    assert not is_tracker(Path("policy.safetensors"))


def test_the_table_has_the_feedback_that_a_policy_was_trained_on() -> None:
    figures = dict.fromkeys(("survived_s", "success", "strict_success", "limb_gain"), 1.0)
    own, alone = ({**figures, "skill": skill, "site_error_m": 0.01} for skill in (0.53, 0.71))
    variants = {"variants": {"hold": own, "regulator": alone}, "baselines": {"statue": figures}}
    lines = verdict_lines({**own, **variants})
    assert [line.split("  ")[0] for line in lines[1:]] == ["trained", "feedback alone", "statue"]
    assert "0.71" in lines[2]
    assert "feedback alone" not in str(verdict_lines({**own, **variants, "tracker": "regulator"}))
