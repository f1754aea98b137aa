"""A robot is known by one name: that of its file and the one inside it."""

import ast
from pathlib import Path

import pytest

from robojackson.errors import BadConfiguration, UnknownName
from robojackson.pipeline import configuration_files
from robojackson.pipeline.robot_descriptions import describe_robot, robot_names
from tests.fixtures.own_robot import own_robot

ROOT = Path(__file__).parents[2]
CODE = ("robojackson", "configs", "storage", "tasks", "flows")


def test_every_shipped_robot_has_the_name_of_its_file() -> None:
    assert [describe_robot(name).name for name in robot_names()] == list(robot_names())


def test_an_unknown_robot_is_refused_with_the_known_ones() -> None:
    with pytest.raises(UnknownName, match=", ".join(robot_names())):
        describe_robot("g2")


def test_the_g1_of_23_hinges_is_the_whole_one_but_for_what_its_file_says() -> None:
    whole, less = describe_robot("g1"), describe_robot("g1_23")
    same = ("mjcf", "source", "sites", "contacts", "stiffness", "fall", "strict", "rest_pose")
    assert [getattr(less, key) for key in same] == [getattr(whole, key) for key in same]
    for key in ("torque_limits", "speed_limits", "armature"):
        assert getattr(less, key).items() < getattr(whole, key).items()
    assert not whole.fixed_joints


@pytest.mark.parametrize("name", robot_names())
def test_a_robot_of_a_wheel_is_pinned_with_its_licence(name: str) -> None:
    found = describe_robot(name)
    assert (found.source is not None) == found.mjcf.startswith("store:")
    assert found.source is None or (found.source.licence and found.source.version)


def test_no_code_names_a_robot_that_is_fetched() -> None:
    """Everything that a robot needs stands in its YAML."""
    fetched = {name for name in robot_names() if describe_robot(name).source}
    files = [path for folder in CODE for path in (ROOT / folder).rglob("*.py")]
    assert len(files) > 300
    named = {
        (path.name, node.value)
        for path in files
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Constant) and node.value in fetched
    }
    assert named == set()


def test_a_copy_with_the_name_of_the_original_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its motions would be taken for those of the other robot."""
    original = configuration_files.SHIPPED / "robots" / "humanoid.yaml"
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots" / "strong.yaml").write_text(original.read_text())
    monkeypatch.setattr(configuration_files, "SHIPPED", tmp_path)
    with pytest.raises(BadConfiguration, match=r"strong\.yaml: name is 'humanoid'"):
        describe_robot("strong")


def test_a_file_is_a_robot_from_wherever_one_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = own_robot(tmp_path / "mine")
    monkeypatch.chdir(tmp_path)
    found = [describe_robot(given) for given in (str(path), "mine/mine.yaml", "./mine/mine.yaml")]
    assert {each.mjcf for each in found} == {str(path.parent / "model.xml")}
    assert {each.file for each in found} == {str(path)}


def test_the_home_folder_may_be_a_tilde(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = own_robot(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert describe_robot("~/mine.yaml").file == str(path)


def test_a_model_that_is_not_beside_the_file_is_found_from_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = own_robot(tmp_path / "yaml")
    (path.parent / "model.xml").rename(tmp_path / "model.xml")
    monkeypatch.chdir(tmp_path)
    assert describe_robot("yaml/mine.yaml").mjcf == str(tmp_path / "model.xml")


def test_the_model_of_a_named_robot_may_lie_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = own_robot(tmp_path / "configs" / "robots")
    monkeypatch.setenv("ROBOJACKSON_CONFIGS", str(tmp_path / "configs"))
    found = describe_robot("mine")
    assert (found.mjcf, found.file) == (str(path.parent / "model.xml"), "")


def test_a_description_is_what_it_says_and_not_where_it_lies(tmp_path: Path) -> None:
    here, there = (describe_robot(str(own_robot(tmp_path / name))) for name in "ab")
    assert here == there


@pytest.mark.parametrize("given", ["gone.yaml", "no/such", "no/such.yml"])
def test_a_file_that_is_not_there_is_one_line_with_the_machine_and_the_names(given: str) -> None:
    with pytest.raises(
        UnknownName, match=r"no file /.* on \S+\)\. Known: g1, g1_23, humanoid"
    ) as caught:
        describe_robot(given)
    assert "\n" not in str(caught.value)


def test_a_model_in_place_of_its_description_names_the_command_that_makes_one(
    tmp_path: Path,
) -> None:
    own_robot(tmp_path)
    with pytest.raises(BadConfiguration, match=r"robojackson robots new .*model\.xml"):
        describe_robot(str(tmp_path / "model.xml"))
