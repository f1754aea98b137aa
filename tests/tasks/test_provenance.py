"""Where the rows of a cell come from, written beside them."""

from pathlib import Path

import pytest

from robojackson.errors import StoreError
from robojackson.files import tables
from robojackson.pipeline.table_schemas import EPISODE_RECORD, EVALUATION_RECORD
from robojackson.rl.config.train_config import EvaluateConfig, TrainConfig
from storage import study_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks import publish_tables
from tasks.study_cell import Cell

CELL = Cell(
    study="s",
    move="walk",
    setup="scratch",
    seed=0,
    reference=Artifact(key="reference.parquet", sha256="0" * 64),
    robot="humanoid",
    train=TrainConfig(steps=100),
    evaluate=EvaluateConfig(),
)
NAMES = {"run_id": "r", "move": "walk", "setup": "scratch", "seed": 0}


def made(store: Store, policy: bytes) -> dict[str, Artifact]:
    """Return the artifacts of the stages of the cell."""
    episode = {"step": 10, "episode": 0, "episode_return": 2.5, "episode_length": 10}
    rollout = {"policy": "trained", "phase": 0, "reset": 0, "survived_s": 1.0, "fell": False}
    rollout |= {"clip_fraction": 1.0, "success": 1.0, "strict_success": 0.0}
    episodes = tables.encode_rows(EPISODE_RECORD, [{**NAMES, **episode}])
    evaluations = tables.encode_rows(EVALUATION_RECORD, [{**NAMES, **rollout}])
    return {
        "policy": store.save("t", "policy.safetensors", policy),
        "training": store.save("t", "training.json", b"{}"),
        "episodes": store.save("t", "episodes.parquet", episodes),
        "evaluations": store.save("t", "evaluations.parquet", evaluations),
    }


def commits(store: Store) -> list[str]:
    return [row["git_commit"] for row in study_tables.query(store, "SELECT git_commit FROM runs")]


def test_rows_that_are_made_again_get_the_commit_that_made_them(
    store_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store(store_folder)
    calls = []
    for commit, policy in (("a", b"first"), ("b", b"first"), ("c", b"second")):
        monkeypatch.setattr(publish_tables, "_commit", lambda commit=commit: commit)
        publish_tables.publish(CELL, "r", made(store, policy))
        calls.append(commits(store))
    assert calls == [["a"], ["a"], ["c"]]


def test_without_git_the_commit_is_what_the_environment_says(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(publish_tables, "app_folder", lambda: tmp_path)
    monkeypatch.setenv("ROBOJACKSON_COMMIT", "0123abc")
    publish_tables._commit.cache_clear()
    assert publish_tables._commit() == "0123abc"
    publish_tables._commit.cache_clear()


def test_the_repository_around_an_installed_package_is_not_requested(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(publish_tables, "is_checkout", lambda: False)
    monkeypatch.setenv("ROBOJACKSON_COMMIT", "0123abc")
    publish_tables._commit.cache_clear()
    assert publish_tables._commit() == "0123abc"
    publish_tables._commit.cache_clear()


def test_a_study_reads_what_a_cell_left_from_the_store_alone(store_folder: Path) -> None:
    left = publish_tables.publish(CELL, "r", made(Store(store_folder), b"p"))
    assert publish_tables.published(CELL, "r") == left
    assert left["episodes"].key.startswith("metrics/episodes/study=s/")


def test_a_cell_that_left_nothing_in_this_store_is_named_with_what_to_do(
    store_folder: Path,
) -> None:
    publish_tables.publish(CELL, "r", made(Store(store_folder), b"p"))
    with pytest.raises(StoreError, match=r"scratch-walk-s0: .* no result of run other: .* store"):
        publish_tables.published(CELL, "other")
