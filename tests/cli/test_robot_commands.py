"""`robojackson robots`: a model out of a pinned wheel, whole or not at all."""

import hashlib
import re
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image

from robojackson.cli import robot_models
from robojackson.cli.pictures import robot_sheets
from robojackson.errors import (
    BadConfiguration,
    DownloadFailed,
    MissingDependency,
    StoreError,
    UnknownName,
)
from robojackson.pipeline.robot_descriptions import robot_names
from robojackson.pipeline.yaml_loader import load
from robojackson.robot.description import RobotDescription, RobotSource
from robojackson.robot.model import load_robot
from tests.fixtures import commands, machine
from tests.fixtures.own_robot import gymnasium_model, own_robot

FOLDER = "bundle/zoo/machine"


def _wheel(folder: Path, model: str) -> Path:
    """Return a wheel of the same layout as the one that bundles the G1."""
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
    """Return the machine's source: a folder that stands for the package index."""
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
    """Return a writer of `configs/robots/machine.yaml`."""

    def give(source: RobotSource | None) -> RobotDescription:
        result = replace(machine.description(tmp_path), mjcf="store:machine.xml", source=source)
        monkeypatch.setattr(robot_models, "describe_robot", lambda name: result)
        return result

    return give


@pytest.mark.medium
def test_the_model_is_unpacked_with_its_licence_and_loads(source, describe, tmp_path: Path):
    description = describe(source)
    result = robot_models.add_robot("machine")
    folder = tmp_path / "store" / "robots" / "machine"
    assert result == {
        "robot": "machine", "model": str(folder / "machine.xml"), "added": True, "licence": "ours",
    }  # fmt: skip
    assert (folder / "licences" / "LICENSE").read_text() == "do what you like"
    assert (folder / "assets" / "hand.txt").is_file()
    assert load_robot(description).joint_names[0] == "left_hip_pitch"
    assert [path.name for path in folder.parent.iterdir()] == ["machine"]


@pytest.mark.medium
def test_a_second_time_changes_nothing_and_needs_no_network(source, describe, monkeypatch):
    describe(source)
    robot_models.add_robot("machine")
    monkeypatch.setenv("PIP_FIND_LINKS", "/nowhere")
    assert robot_models.add_robot("machine")["added"] is False


@pytest.mark.medium
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


@pytest.mark.medium
def test_another_wheel_than_the_pinned_one_leaves_nothing(source, describe, tmp_path: Path):
    describe(replace(source, wheel_sha256="0" * 64))
    with pytest.raises(DownloadFailed, match=r"sha256 is [0-9a-f]{64}, expected 0{64}"):
        robot_models.add_robot("machine")
    assert list((tmp_path / "store" / "robots").iterdir()) == []


@pytest.mark.medium
def test_offline_is_one_line(source, describe, tmp_path: Path, monkeypatch):
    describe(source)
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path / "empty"))
    with pytest.raises(DownloadFailed, match=r"^pip could not download bundle==1.0: .*$"):
        robot_models.add_robot("machine")


def test_an_environment_without_pip_is_told_how_to_get_it(source, describe, monkeypatch):
    """As one that uv made; it is no fault of the network."""
    describe(source)
    monkeypatch.setattr(robot_models.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(
        MissingDependency, match=r"which this environment lacks: run .*-m ensurepip"
    ):
        robot_models.add_robot("machine")


def test_a_full_disk_is_reported_before_the_download(source, describe, monkeypatch):
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
    with pytest.raises(BadConfiguration, match="needs no download"):
        robot_models.add_robot("humanoid")


def test_an_unknown_robot_lists_the_known_ones():
    with pytest.raises(UnknownName, match=", ".join(robot_names())):
        robot_models.add_robot("g2")


def test_the_list_says_what_is_here(monkeypatch, tmp_path: Path):
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path))
    ready = {entry["robot"]: entry["ready"] for entry in robot_models.list_robots()}
    here = {name for name, is_ready in ready.items() if is_ready}
    assert here == {"humanoid", "humanoid_strong"}
    assert set(ready) - here == {"g1", "g1_23", "t1"}


@pytest.mark.medium
def test_robots_of_one_model_share_its_folder(source, describe, tmp_path: Path, monkeypatch):
    shared = replace(source, shared_folder="machines")
    describe(shared)
    robot_models.add_robot("machine")
    monkeypatch.setenv("PIP_FIND_LINKS", "/nowhere")
    less = replace(describe(shared), name="less", fixed_joints={"waist": 0.1})
    monkeypatch.setattr(robot_models, "describe_robot", lambda name: less)
    assert robot_models.add_robot("less")["added"] is False
    assert [path.name for path in (tmp_path / "store" / "robots").iterdir()] == ["machines"]
    assert "waist" not in load_robot(less).joint_names


def test_the_shipped_g1_pins_its_wheel_and_its_model():
    source = load(RobotDescription, "robots/g1").source
    assert source is not None
    assert (source.package, source.version) == ("mjlab", "1.6.0")
    assert source.wheel_sha256.startswith("03d00385")


@pytest.mark.medium
def test_the_command_lists_the_robots_as_json(tmp_path: Path):
    command = [sys.executable, "-m", "robojackson", "robots", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert '"robot": "humanoid_strong"' in done.stdout


def broken(folder: Path, old: str, new: str) -> Path:
    """Return a user's description with one thing changed."""
    path = own_robot(folder)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    return path


@pytest.mark.medium
def test_a_good_description_is_reported_and_drawn(tmp_path: Path):
    found, lines = robot_sheets.check_robot(str(own_robot(tmp_path)), tmp_path / "mine.png")
    assert (found["ok"], found["problems"], found["hinges"], found["motors"]) == (True, [], 17, 17)
    assert found["height_m"] == pytest.approx(1.56, abs=0.02)
    assert found["contacts"] == pytest.approx({"left_foot": 0.0, "right_foot": 0.0}, abs=1e-9)
    assert found["keypoints"]["left_knee"] == "left_shin"
    assert any(re.match(r"left_knee +-160.0 +-2.0 +-17.2 +80$", line) for line in lines)
    with Image.open(tmp_path / "mine.png") as picture:
        assert picture.width > 2000


@pytest.mark.parametrize(
    ("old", "new", "cause"),
    [
        ("left_foot: [left_foot", "left_foot: [left_shoe", "unknown body 'left_shoe'"),
        ("  head: [torso, [0.0, 0.0, 0.19]]\n", "", "sites: missing head"),
        ("radius: 0.075, body: left_foot", "radius: -0.075, body: left_foot", "greater than 0"),
        ("[left_lower_arm, [0.18,", "[left_lower_arm, [0.1,", "must be mirrored"),
        ("mjcf: model.xml", "mjcf: gone.xml", "no such file: "),
        ("root_body:", "root_bodi:", "unknown key 'root_bodi'. Did you mean 'root_body'?"),
    ],
)
def test_a_broken_description_is_reported_in_a_line_that_names_the_file(
    tmp_path: Path, old, new, cause
):
    path = broken(tmp_path, old, new)
    found, lines = robot_sheets.check_robot(str(path), None)
    assert not found["ok"]
    assert any(cause in line and str(path) in line for line in found["problems"])
    assert found["problems"] == lines[1:-2]
    assert found["verdict"]["kind"] == "problems"


def test_wrong_keys_are_reported_all_at_once(tmp_path: Path):
    path = broken(tmp_path, "root_body: torso", "root_bodi: torso\nspeed: 3")
    found, _ = robot_sheets.check_robot(str(path), None)
    assert all(any(key in line for line in found["problems"]) for key in ("root_bodi", "speed"))


def test_new_writes_a_description_that_passes_and_keeps_a_file_that_is_there(
    tmp_path: Path, monkeypatch
):
    model = tmp_path / "model.xml"
    model.write_text(gymnasium_model().read_text())
    monkeypatch.chdir(tmp_path)
    found, lines = robot_sheets.new_robot(model, None, force=False)
    assert (found["file"], found["ok"], found["left"]) == ("my_humanoid.yaml", True, [])
    assert lines[-1] == "next: robojackson robots check my_humanoid.yaml -o my_humanoid.png"
    Path("my_humanoid.yaml").write_text("mine")
    with pytest.raises(StoreError, match="exists; --force"):
        robot_sheets.new_robot(model, None, force=False)
    assert Path("my_humanoid.yaml").read_text() == "mine"
    robot_sheets.new_robot(model, Path("my_humanoid.yaml"), force=True)
    assert Path("my_humanoid.yaml").read_text() != "mine"


@pytest.mark.medium
def test_new_runs_as_a_command(tmp_path: Path):
    model = tmp_path / "machine.xml"
    model.write_text(machine.mjcf())
    result = commands.in_process("robots", "new", model, "-o", tmp_path / "it.yaml", "--json")
    assert (result.code, result.answer["file"]) == (0, str(tmp_path / "it.yaml"))
    assert (tmp_path / "it.yaml").is_file()


@pytest.mark.medium
def test_add_runs_as_a_command(source, describe):
    describe(source)
    result = commands.in_process("robots", "add", "machine", "--json")
    assert (result.code, result.answer["added"]) == (0, True)


def test_new_says_which_keys_are_left(tmp_path: Path):
    model = tmp_path / "machine.xml"
    model.write_text(machine.mjcf())
    _, lines = robot_sheets.new_robot(model, tmp_path / "it.yaml", force=False)
    assert any(line.startswith("left     torque_limits: ") for line in lines)
    assert any(line.startswith("guessed  sites.head: ") for line in lines)


def test_new_says_why_no_legs_were_found(tmp_path: Path):
    """A model that faces along y, as the CMU humanoid of dm_control does."""
    turned = gymnasium_model().read_text()
    turned = turned.replace('<body name="torso"', '<body name="torso" euler="0 0 -90"')
    (tmp_path / "aside.xml").write_text(turned.replace("left", "a").replace("right", "b"))
    _, lines = robot_sheets.new_robot(tmp_path / "aside.xml", tmp_path / "it.yaml", force=False)
    assert any(line.startswith("hint     no legs were found; ") for line in lines)


@pytest.mark.medium
def test_the_commands_answer_as_json_with_an_exit_code(tmp_path: Path):
    good, bad = own_robot(tmp_path / "a"), broken(tmp_path / "b", "[torso,", "[tors,")
    result = [commands.robojackson("robots", "check", path, "--json") for path in (good, bad)]
    assert [(each.code, each.answer["ok"]) for each in result] == [(0, True), (1, False)]
    assert good.with_suffix(".png").is_file()
    assert not bad.with_suffix(".png").exists()


@pytest.mark.parametrize("group", ["robots", "trackers"])
def test_an_option_before_a_subcommand_is_not_dropped(group: str) -> None:
    done = commands.in_process(group, "--json", "add", "nosuch")
    assert (done.code, done.out) == (2, "")
    assert "give --json after the subcommand" in done.err
