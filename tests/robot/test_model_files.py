"""The door for robot models: what it opens, and which numbers it refuses."""

import os
from pathlib import Path

import pytest

from robojackson.errors import BadConfiguration
from robojackson.robot.model_files import MOST_PARTS, files_of, read_model

BODY = '<worldbody><body><freejoint/><geom size=".1"/></body></worldbody>'


def mjcf(folder: Path, inside: str, name: str = "a.xml") -> Path:
    path = folder / name
    path.write_text(f"<mujoco>{inside}</mujoco>")
    return path


@pytest.mark.parametrize(
    "element", ['<include file="b.xml"/>', '<include file="b.xml" file="b.xml"/>']
)
def test_a_pipe_that_a_model_names_is_refused_without_opening_it(
    tmp_path: Path, element: str
) -> None:
    os.mkfifo(tmp_path / "b.xml")
    with pytest.raises(BadConfiguration, match="a device or a pipe"):
        read_model(mjcf(tmp_path, element + BODY))


def test_files_that_include_one_another_for_ever_are_refused(tmp_path: Path) -> None:
    for n in range(MOST_PARTS + 1):
        mjcf(tmp_path, f'<include file="{n + 1}.xml"/>', f"{n}.xml")
    mjcf(tmp_path, BODY, f"{MOST_PARTS + 1}.xml")
    with pytest.raises(BadConfiguration, match=f"more than {MOST_PARTS} files"):
        read_model(tmp_path / "0.xml")
    assert read_model(tmp_path / "50.xml").nbody == 2


def test_what_is_no_strict_xml_names_its_files_all_the_same(tmp_path: Path) -> None:
    (tmp_path / "b.stl").write_text("")
    path = mjcf(tmp_path, '<asset><mesh name="m" name="m" file="b.stl"/></asset>')
    assert files_of(path) == [path, tmp_path / "b.stl"]


@pytest.mark.parametrize(
    "inside",
    [
        '<option gravity="nan 0 0"/>',
        '<option gravity="0 0 1e300"/>',
        '<option timestep="1e-300"/>',
        '<option timestep="nan"/>',
        '<worldbody><body><joint stiffness="1e300"/><geom size=".1"/></body></worldbody>',
        '<worldbody><geom size=".1" rgba="nan 0 0 1"/></worldbody>',
        '<worldbody><camera pos="nan 0 0"/></worldbody>',
    ],
)
def test_numbers_with_which_nothing_can_be_computed_are_refused(
    tmp_path: Path, inside: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # where MuJoCo would write its log
    with pytest.raises(BadConfiguration, match=r"a\.xml: "):
        read_model(mjcf(tmp_path, inside + BODY))
    assert os.listdir(tmp_path) == ["a.xml"]


@pytest.mark.parametrize("content", [b"\x89PNG\r\n\x1a\n", b"<mujoco>\n<worldbody\n</mujoco>"])
def test_what_is_no_xml_is_named_as_such(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.xml").write_bytes(content)
    with pytest.raises(BadConfiguration, match=r"a\.xml: not XML, which MJCF and URDF are, from "):
        read_model(tmp_path / "a.xml")


def test_every_file_that_a_mesh_may_be_read_from_belongs_to_the_model(tmp_path: Path) -> None:
    """With `meshdir` MuJoCo does not read the one beside the model."""
    (tmp_path / "meshes").mkdir()
    for folder in (tmp_path, tmp_path / "meshes"):
        (folder / "a.stl").write_text("")
    inside = '<compiler meshdir="meshes"/><asset><mesh name="m" file="a.stl"/></asset>'
    assert tmp_path / "meshes" / "a.stl" in files_of(mjcf(tmp_path, inside))


@pytest.mark.parametrize("name", ["package://robot/meshes/a.stl", "a.stl"])
def test_the_meshes_of_a_urdf_belong_to_it(tmp_path: Path, name: str) -> None:
    (tmp_path / "a.stl").write_text("")
    path = tmp_path / "robot.urdf"
    mesh = f'<visual><geometry><mesh filename="{name}"/></geometry></visual>'
    path.write_text(f'<robot name="r"><link name="base">{mesh}</link></robot>')
    assert files_of(path) == [path, tmp_path / "a.stl"]


def test_a_part_without_a_name_gets_one_that_is_free_and_the_others_keep_theirs(
    tmp_path: Path,
) -> None:
    ball = '<geom size=".1" mass="1"/>'
    bodies = f'<body>{ball}<freejoint/><body name="body_1">{ball}<joint/></body></body>'
    model = read_model(mjcf(tmp_path, f"<worldbody>{bodies}</worldbody>"))
    assert [model.body(i).name for i in range(3)] == ["world", "body_1_", "body_1"]
    assert [model.joint(i).name for i in range(2)] == ["", "joint_1"]
