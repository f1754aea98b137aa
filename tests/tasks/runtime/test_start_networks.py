"""Networks to start from, in a store that is no folder."""

from pathlib import Path

import pytest

from robojackson.errors import BadPolicy
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.walkers import walker_key
from storage.store import Store
from tasks.runtime.start_networks import local_start_file
from tests.fixtures import machine

WALKER = TrainConfig(start="walker", steps=1)


def test_a_walker_of_an_object_store_is_copied_to_each_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROBOJACKSON_STORE", "memory://walkers")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "machine").mkdir()
    robot, store = machine.description(tmp_path / "machine"), Store.from_environment()
    with pytest.raises(BadPolicy, match="has no walker yet"):
        local_start_file(store, WALKER, robot)
    for content in (b"networks", b"better networks"):
        store.put(walker_key(robot, "track"), content)
        found = local_start_file(store, WALKER, robot)
        assert found is not None
        assert found.is_relative_to(tmp_path / "cache")
        assert found.read_bytes() == content


def test_a_walker_of_one_object_store_is_none_of_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    robot = machine.description(tmp_path)
    for name in ("one", "other"):
        monkeypatch.setenv("ROBOJACKSON_STORE", f"memory://{name}-{tmp_path.name}")
        store = Store.from_environment()
        with pytest.raises(BadPolicy, match="has no walker yet"):
            local_start_file(store, WALKER, robot)
        store.put(walker_key(robot, "track"), b"networks")
        assert local_start_file(store, WALKER, robot)


def test_a_training_from_scratch_starts_from_no_file(store_folder: Path, tmp_path: Path) -> None:
    store = Store.from_environment()
    assert local_start_file(store, TrainConfig(steps=1), machine.description(tmp_path)) is None
