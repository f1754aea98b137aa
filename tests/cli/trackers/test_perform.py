"""`robojackson perform`: tables and a page of several dances, danced by a tracker."""

import json
from pathlib import Path

import numpy as np
import pytest

from robojackson.cli.trackers.tracker_files import add_tracker
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.rollout import Rollout
from tests.fixtures.commands import in_process, robojackson
from tests.fixtures.robots import robot_motion
from tests.fixtures.stand_in_tracker import NAME, stand_in, write_yaml


@pytest.fixture
def dance(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a motion of the humanoid named `<b>`, and the stand-in in the store."""
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "store"))
    monkeypatch.setenv("ROBOJACKSON_CONFIGS", str(tmp_path / "configs"))
    file, description = stand_in(tmp_path)
    write_yaml(description, tmp_path / "configs")
    add_tracker(NAME, file)
    path = tmp_path / "<b>.parquet"
    path.write_bytes(robot_motion("hip_shake").to_bytes())
    return path


@pytest.mark.slow
def test_a_performance_leaves_its_tables_and_a_page(dance: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = robojackson(
        *("perform", dance, "-o", out, "--robot", "humanoid", "--tracker", NAME, "--runs", 2),
        *("--seconds", 1, "--no-film", "--json"),
    )
    assert result.code == 0, result.err
    answer = json.loads(result.out)
    assert (answer["tracker"], answer["runs"], answer["film"]) == (NAME, 2, None)
    assert [row["seed"] for row in answer["rows"]] == [0, 1]
    assert answer["finished"] == sum(row["finished"] for row in answer["rows"])
    assert [row["part"] for row in answer["parts"]] == ["stand", "way", "<b>", "way", "stand"]
    programme = ReferenceMotion.load(out / "programme.parquet")
    rollout = Rollout.load(out / "rollout.parquet")
    assert 0 < len(rollout.qpos) <= 2 * len(programme)
    assert np.isfinite(rollout.qpos).all()
    page = (out / "index.html").read_text()
    assert "&lt;b&gt;" in page
    assert "<b>.parquet" not in page


@pytest.mark.parametrize(
    ("settings", "text"),
    [(("robot=g2",), "robot 'g2'"), (("robot=humanoid", "tracker=xy"), "tracker 'xy'")],
)
def test_robot_and_tracker_may_be_given_as_settings(
    settings: tuple[str, ...], text: str, dance: Path, tmp_path: Path
) -> None:
    given = (word for setting in settings for word in ("--set", setting))
    result = in_process("perform", dance, "-o", tmp_path / "out", *given)
    assert (result.code, f"UnknownName: unknown {text}" in result.err) == (1, True)


def test_the_robot_of_a_configuration_performs(dance: Path, tmp_path: Path) -> None:
    own = tmp_path / "mine.yaml"
    own.write_text(f"robot: g1_23\ntracker: {NAME}\n")
    result = in_process("perform", dance, "-o", tmp_path / "out", "--config", own)
    assert (result.code, "g1_23" in result.err) == (1, True), result.err


@pytest.mark.slow
def test_an_unknown_robot_is_one_line(dance: Path, tmp_path: Path) -> None:
    words = ("perform", dance, "-o", tmp_path / "out", "--robot", "nobody")
    result = robojackson(*words, "--tracker", NAME)
    assert result.code == 1
    assert result.err.startswith("robojackson: UnknownName: unknown robot 'nobody'")
    assert "Traceback" not in result.err
