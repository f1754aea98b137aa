"""What a study trains, checked before anything begins."""

from pathlib import Path

import pytest
import yaml

from configs.study_config import Study
from flows.study.study_plan import study_of, trainings_of
from robojackson.errors import BadConfiguration, BadPolicy, UnknownName
from robojackson.pipeline.yaml_loader import load
from tests.fixtures import machine


def study(tmp_path: Path, **given: object) -> Path:
    """Return a study of two moves, one of them with steps of its own."""
    path = tmp_path / "mine.yaml"
    facts = {"name": "mine", "moves": ["walk", "dance_b"], "setups": ["scratch"], "steps": 700}
    path.write_text(yaml.safe_dump(facts | {"move_steps": {"walk": 500}} | given))
    return path


def test_a_move_may_have_steps_of_its_own(tmp_path: Path) -> None:
    expected = study_of(str(study(tmp_path)), {})
    assert (expected.steps_of("walk"), expected.steps_of("dance_b")) == (500, 700)
    assert expected.steps_label == "walk 500, dance_b 700"


def test_steps_of_the_command_are_those_of_every_move(tmp_path: Path) -> None:
    expected = study_of(str(study(tmp_path)), {"steps": 64})
    assert expected.steps_label == "64"


def test_a_study_cut_to_one_move_keeps_the_steps_of_the_others(tmp_path: Path) -> None:
    assert study_of(str(study(tmp_path)), {"moves": ["dance_b"]}).steps_label == "700"


def test_steps_of_a_move_that_does_not_exist_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match="wolk"):
        study_of(str(study(tmp_path, move_steps={"wolk": 500})), {})


def test_a_setup_from_a_walker_is_refused_for_a_robot_that_has_none(
    tmp_path: Path, store_folder: Path
) -> None:
    expected = Study(name="mine", setups=("scratch", "pretrain"), mode="track")
    robot = machine.description(tmp_path)
    with pytest.raises(BadPolicy, match="run: robojackson pretrain --robot"):
        trainings_of(expected, robot)
    alone = Study(name="mine", setups=("scratch",), mode="track")
    assert list(trainings_of(alone, robot)) == ["scratch"]


def test_a_study_of_a_robot_whose_model_is_missing_names_the_command(store_folder: Path) -> None:
    with pytest.raises(BadConfiguration, match="run: robojackson robots add g1"):
        study_of("g1", {})


def test_a_study_whose_name_has_a_dot_is_found_in_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "studies").mkdir()
    (tmp_path / "studies" / "v1.2.yaml").write_text("extends: studies/smoke\nname: other\n")
    monkeypatch.setenv("ROBOJACKSON_CONFIGS", str(tmp_path))
    assert study_of("v1.2", {}).name == "other"


@pytest.mark.parametrize("text", ["seeds: [0]\n", "extends: studies/smoke\n"])
def test_a_study_without_a_name_of_its_own_is_called_as_its_file(
    text: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Its cells and its page would be those of the study `paper`, or of the one it extends."""
    (tmp_path / "mine.v2.yaml").write_text(text)
    assert study_of(str(tmp_path / "mine.v2.yaml"), {}).name == "mine.v2"
    assert study_of(str(tmp_path / "mine.v2.yaml"), {"name": "other"}).name == "other"
    (tmp_path / "2026.yaml").write_text(text)
    assert study_of(str(tmp_path / "2026.yaml"), {}).name == "2026"
    assert caplog.text == ""


def test_a_copy_of_a_study_that_keeps_its_name_is_warned_about(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "copy.yaml").write_text("name: paper\nseeds: [0]\n")
    assert study_of(str(tmp_path / "copy.yaml"), {}).name == "paper"
    assert "copy.yaml: the name of the study is paper" in caplog.text


def test_the_study_of_the_g1_is_scratch_and_walker_on_three_moves_and_five_seeds() -> None:
    expected = load(Study, "studies/g1")
    assert (expected.setups, len(expected.moves), len(expected.seeds)) == (
        ("scratch", "pretrain"),
        3,
        5,
    )
    assert [expected.steps_of(move) for move in expected.moves] == [500_000, 750_000, 750_000]
