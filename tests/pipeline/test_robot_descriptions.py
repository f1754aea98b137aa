"""A robot is known by one name: that of its file and the one inside it."""

from pathlib import Path

import pytest

from robojackson.errors import BadConfiguration, UnknownName
from robojackson.pipeline import yaml_loader
from robojackson.pipeline.robot_descriptions import describe_robot, robot_names


def test_every_shipped_robot_has_the_name_of_its_file() -> None:
    assert [describe_robot(name).name for name in robot_names()] == list(robot_names())


def test_an_unknown_robot_is_refused_with_the_known_ones() -> None:
    with pytest.raises(UnknownName, match="g1, humanoid, humanoid_strong"):
        describe_robot("g2")


def test_a_copy_with_the_name_of_the_original_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its motions would be taken for those of the other robot."""
    original = yaml_loader.SHIPPED / "robots" / "humanoid.yaml"
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots" / "strong.yaml").write_text(original.read_text())
    monkeypatch.setattr(yaml_loader, "SHIPPED", tmp_path)
    with pytest.raises(BadConfiguration, match=r"strong\.yaml: name is 'humanoid'"):
        describe_robot("strong")
