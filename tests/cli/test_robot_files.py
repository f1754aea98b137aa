"""A robot that is given by its file, through the commands of one stage."""

import re
from pathlib import Path
from typing import Any

import pytest

from robojackson.cli import cards, exporting, stages
from robojackson.cli.learning import training_process, walker_training
from robojackson.cli.options import yaml_text
from robojackson.errors import BadConfiguration, RejectedReference, UnknownName
from robojackson.motion.reference_motion import ReferenceMotion
from tests.fixtures.own_robot import own_robot
from tests.fixtures.robots import human

SHORT = {"trainer": "sb3", "steps": 64}


class Made:
    """A motion for a user's robot, and the folder that it is in."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.robot = folder, own_robot(folder / "my robots: 1")
        human("hip_shake").save(folder / "smpl.parquet")
        overrides = {"robot": yaml_text(str(self.robot))}
        stages.retarget(folder / "smpl.parquet", folder, "smoke", overrides)
        self.reference = folder / "reference.parquet"

    def train(self, out: str, robot: str | None = None) -> dict[str, Any]:
        return training_process.train(
            self.reference, self.folder / out, None, SHORT, force=True, robot=robot
        )


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    return Made(tmp_path_factory.mktemp("own"))


@pytest.mark.medium
def test_the_motion_remembers_the_file_whatever_its_name(made: Made) -> None:
    motion = ReferenceMotion.load(made.reference)
    assert (motion.robot, motion.robot_file) == ("mine", str(made.robot))


@pytest.mark.medium
def test_train_evaluate_and_export_find_the_robot_by_themselves(made: Made) -> None:
    policy = Path(made.train("policy")["policy"])
    overrides = {"evaluate.seconds": 0.1}
    evaluated = stages.evaluate(policy, made.reference, None, "smoke", overrides)
    assert evaluated["rollouts"] > 0
    result = exporting.export(made.reference, "gmr", made.folder / "motion.pkl")
    assert result["robot"] == "mine"


@pytest.mark.medium
def test_a_file_that_is_gone_is_one_line_that_says_what_to_give(made: Made) -> None:
    elsewhere = made.robot.rename(made.robot.with_stem("moved"))
    try:
        with pytest.raises(
            UnknownName, match=r"'mine' .*mine\.yaml, which is not on .*--robot FILE"
        ):
            made.train("gone")
        assert made.train("given", str(elsewhere))["steps"] >= SHORT["steps"]
        text = exporting.export(made.reference, "gmr", made.folder / "m.pkl", str(elsewhere))
        assert text["robot"] == "mine"
    finally:
        elsewhere.rename(made.robot)


@pytest.mark.medium
def test_a_motion_that_does_not_name_the_file_says_so(made: Made, tmp_path: Path) -> None:
    """As the motions of the flows, which may be read on another machine."""
    from dataclasses import replace

    path = replace(ReferenceMotion.load(made.reference), robot_file="").save(tmp_path / "r.parquet")
    with pytest.raises(
        UnknownName, match=r"'mine' .*does not name its description.*give --robot FILE"
    ):
        exporting.export(path, "gmr", tmp_path / "m.pkl")


@pytest.mark.medium
def test_a_robot_with_unstable_gains_is_retargeted_without_a_training_next(tmp_path: Path) -> None:
    robot = own_robot(tmp_path)
    text = re.sub(r"(?m)^damping:.*\n(  .*\n)+", "damping: {'*': 900.0}\n", robot.read_text())
    robot.write_text(text)
    human("hip_shake").save(tmp_path / "smpl.parquet")
    overrides = {"robot": yaml_text(str(robot))}
    result = stages.retarget(tmp_path / "smpl.parquet", tmp_path, "smoke", overrides)
    assert "next" not in result
    assert "mine.yaml: damping: the gains of" in result["hint"]
    assert any("the gains of" in line for line in cards.retarget_lines(result))


@pytest.mark.medium
def test_another_model_than_the_motions_is_refused(made: Made, tmp_path: Path) -> None:
    other = own_robot(tmp_path)
    model = other.parent / "model.xml"
    model.write_text(model.read_text().replace('size="0.07"', 'size="0.08"', 1))
    with pytest.raises(RejectedReference, match="another model of 'mine'"):
        made.train("other", str(other))
    other.write_text(other.read_text().replace("name: mine", "name: other"))
    with pytest.raises(RejectedReference, match="made for robot 'mine', not for 'other'"):
        made.train("other", str(other))


@pytest.mark.medium
def test_a_file_that_is_not_there_is_one_line(made: Made) -> None:
    with pytest.raises(UnknownName, match=r"unknown robot 'no/robot\.yaml' \(no file /"):
        stages.retarget(
            made.folder / "smpl.parquet", made.folder, "smoke", {"robot": "no/robot.yaml"}
        )


@pytest.mark.medium
def test_the_walker_of_the_paper_is_humanoid_v5(made: Made, tmp_path: Path) -> None:
    with pytest.raises(BadConfiguration, match="kind 'paper' is humanoid; take --kind track"):
        walker_training.pretrain("paper", tmp_path, None, {}, str(made.robot))
