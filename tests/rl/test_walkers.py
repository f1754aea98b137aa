"""Which walker a training of a robot starts from."""

from dataclasses import replace
from pathlib import Path

import pytest

from robojackson.errors import BadPolicy
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.rl.pretrained import pretrained
from robojackson.rl.walkers import is_shipped, keep_walker, shipped_walker, walker_file
from robojackson.robot.description import RobotDescription
from robojackson.robot.mjcf import mjcf_path
from tests.fixtures import machine
from tests.fixtures.own_robot import own_robot


@pytest.fixture
def other(tmp_path: Path) -> RobotDescription:
    """Return a robot for which no walker ships."""
    (tmp_path / "machine").mkdir()
    return machine.description(tmp_path / "machine")


@pytest.mark.parametrize("mode", ["track", "paper"])
def test_the_papers_robot_starts_from_the_walker_that_ships(store_folder: Path, mode: str) -> None:
    assert walker_file(describe_robot("humanoid"), mode) == shipped_walker(mode)


def test_a_robot_of_the_same_model_starts_from_the_walker_that_ships(
    store_folder: Path, tmp_path: Path
) -> None:
    mine = describe_robot(str(own_robot(tmp_path / "mine")))
    assert mine.name != "humanoid"
    assert walker_file(mine, "track") == shipped_walker("track")


def test_a_robot_without_a_walker_is_refused_with_the_command_that_trains_one(
    store_folder: Path, other: RobotDescription
) -> None:
    assert not is_shipped(other, "track")
    named = other.file or other.name
    with pytest.raises(BadPolicy, match=rf"has no walker yet; run: robojackson pretrain .*{named}"):
        pretrained("walker", "track", other)


def test_no_command_is_offered_for_a_walker_that_only_the_papers_robot_has(
    store_folder: Path, other: RobotDescription
) -> None:
    with pytest.raises(BadPolicy, match=r"mode paper has no walker for robot .*; take mode=track"):
        walker_file(other, "paper")


def test_a_saved_walker_is_what_its_robot_starts_from(
    store_folder: Path, other: RobotDescription
) -> None:
    kept = keep_walker(other, "track", shipped_walker("track").read_bytes())
    assert kept.is_relative_to(store_folder)
    assert walker_file(other, "track") == kept
    networks = pretrained("walker", "track", other)
    assert networks is not None
    assert networks.action_size == 17


def test_a_walker_of_another_model_of_the_same_name_is_not_taken(
    store_folder: Path, other: RobotDescription, tmp_path: Path
) -> None:
    keep_walker(other, "track", b"networks")
    heavier = tmp_path / "heavier.xml"
    heavier.write_text(mjcf_path(other).read_text().replace('mass="1"', 'mass="2"'))
    with pytest.raises(BadPolicy, match="has no walker yet"):
        walker_file(replace(other, mjcf=str(heavier)), "track")


def test_a_robot_with_fewer_hinges_does_not_start_from_the_walker_of_all(
    store_folder: Path,
) -> None:
    stiff = replace(describe_robot("humanoid"), name="stiff", fixed_joints={"abdomen_z": 0.0})
    assert not is_shipped(stiff, "track")
    assert is_shipped(replace(stiff, fixed_joints={}), "track")


def test_a_start_that_is_a_folder_names_the_files_in_it(tmp_path: Path) -> None:
    with pytest.raises(BadPolicy, match=r"is a folder; name policy\.safetensors or"):
        pretrained(str(tmp_path), "track")
