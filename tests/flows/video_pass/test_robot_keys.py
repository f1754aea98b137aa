"""A robot of a user's own in the stages: known by what it is, never by where it lies."""

import asyncio
from dataclasses import replace
from pathlib import Path

import pytest

from flows.dance import dance
from flows.study.study_plan import study_of
from robojackson.errors import UnknownName
from robojackson.pipeline.robot_descriptions import describe_robot, read_description
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.rl.config.train_config import TrainConfig
from robojackson.robot.description import RobotDescription
from robojackson.robot.model import load_robot
from storage.artifact import Artifact
from tasks.retarget_motion import retarget_motion
from tasks.runtime.robot_digests import robot_file
from tasks.runtime.stage import identity
from tasks.train_policy import RunLabels, run_id_of
from tests.fixtures.own_robot import own_robot


def key(robot: Path) -> str:
    """Return the key under which a motion for the robot of a file is recorded."""
    return motion_key(describe_robot(str(robot)))


def motion_key(robot: RobotDescription) -> str:
    """Return the key under which a motion for a robot is recorded."""
    sequence = Artifact(key="smpl", sha256="0" * 64)
    given = {"sequence": sequence, "robot": robot, "config": RetargetConfig()}
    return retarget_motion.recipe.key(given)


def test_the_same_robot_in_another_folder_is_the_same(tmp_path: Path) -> None:
    assert key(own_robot(tmp_path / "a")) == key(own_robot(tmp_path / "b"))


def test_no_path_is_in_what_a_robot_is(tmp_path: Path) -> None:
    assert str(tmp_path) not in str(identity(describe_robot(str(own_robot(tmp_path)))))


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [("mine.yaml", "left_hand: 1.5", "left_hand: 1.4"), ("model.xml", "-160", "-150")],
)
def test_another_weight_or_another_model_is_another_robot(
    tmp_path: Path, file: str, old: str, new: str
) -> None:
    path = own_robot(tmp_path)
    before, altered = key(path), path.parent / file
    altered.write_text(altered.read_text().replace(old, new))
    assert key(path) != before


@pytest.mark.parametrize("part", ["torque_limits", "contacts"])
def test_another_order_of_patterns_or_contacts_is_another_robot(part: str) -> None:
    """The last pattern that matches counts, and contacts are the columns of a motion."""
    robot = describe_robot("humanoid")
    turned = replace(robot, **{part: dict(reversed(getattr(robot, part).items()))})
    config, labels = TrainConfig(), RunLabels("move", "setup")
    assert motion_key(turned) != motion_key(robot)
    ids = {run_id_of(Artifact("r", "0" * 64), one, config, labels) for one in (robot, turned)}
    assert len(ids) == 2


def test_a_process_reads_the_description_that_the_stage_was_given(tmp_path: Path) -> None:
    given = describe_robot(str(own_robot(tmp_path / "mine")))
    assert list(given.contacts) != sorted(given.contacts)
    (tmp_path / "work").mkdir()
    read = read_description(robot_file(given, tmp_path / "work"))
    assert read == given
    assert load_robot(read).contact_names == load_robot(given).contact_names
    assert load_robot(read).sha256 == load_robot(given).sha256


def test_a_study_keeps_the_whole_path_of_its_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its cells run in other working directories."""
    path = own_robot(tmp_path)
    monkeypatch.chdir(tmp_path)
    study = study_of("smoke", {"robot": "./mine.yaml"})
    assert study.robot == str(path)
    assert str(path) not in str(identity(study))


@pytest.mark.medium
def test_a_robot_that_is_not_where_the_flow_runs_is_one_line(
    prefect_server: None, short_clip: Path, store_folder: Path
) -> None:
    with pytest.raises(UnknownName, match=r"unknown robot '/gone/mine\.yaml' \(no file .* on "):
        asyncio.run(dance(str(short_clip), "smoke", robot="/gone/mine.yaml"))


@pytest.mark.slow
def test_the_flow_dances_on_a_robot_given_by_its_file(
    prefect_server: None, short_clip: Path, store_folder: Path, tmp_path: Path
) -> None:
    overrides = {"train.trainer": "sb3", "train.steps": 300}
    robot = str(own_robot(tmp_path / "here"))
    text = asyncio.run(dance(str(short_clip), "smoke", overrides, robot=robot))
    assert text["robot"] == "mine"
    assert Path(text["page"]).is_file()
