"""The table of a study: true at the end, and few versions for many changes."""

import asyncio
import json
import logging
from pathlib import Path
from typing import Any

import pytest

from configs.study_config import Study
from flows.study import progress_table
from robojackson.rl.config.train_config import EvaluateConfig, TrainConfig
from storage.artifact import Artifact
from storage.store import Store
from tasks.study_cell import Cell

STUDY = Study(name="many", moves=("walk",), setups=("scratch",), seeds=tuple(range(100)))
REFERENCE = Artifact(key="retarget/reference.parquet", sha256="0" * 64)


def cells() -> list[Cell]:
    names: dict[str, Any] = {"study": "many", "move": "walk", "setup": "scratch"}
    made: dict[str, Any] = {"reference": REFERENCE, "robot": "humanoid"}
    made |= {"train": TrainConfig(steps=100), "evaluate": EvaluateConfig()}
    return [Cell(**names, **made, seed=seed) for seed in STUDY.seeds]


def versions(monkeypatch: pytest.MonkeyPatch, store: Path, away: bool = False) -> list[list[Any]]:
    """Return the states by version, of a study whose cells all end at once but the last, which
    fails."""
    shown: list[list[Any]] = []
    summary = Store(store).put("evaluation.json", json.dumps({"skill": 0.5}).encode())

    async def show(key: str, table: list[dict[str, Any]], description: str) -> None:
        if away:
            raise ConnectionError("no server")
        shown.append([row["state"] for row in table])

    async def run() -> None:
        given = cells()
        table = progress_table.ProgressTable(STUDY, given)
        async with table.shown():
            await asyncio.sleep(0)
            for cell in given[:-1]:
                table.done(cell, {"evaluation": summary})
                await asyncio.sleep(0)
            table.failed(given[-1], "diverged")

    monkeypatch.setattr(progress_table, "acreate_table_artifact", show)
    monkeypatch.setattr(progress_table, "get_run_logger", lambda: logging.getLogger("test"))
    asyncio.run(run())
    return shown


def test_the_last_version_has_every_cell_as_it_ended(
    store_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert versions(monkeypatch, store_folder)[-1] == ["done"] * 99 + ["failed"]


def test_a_hundred_changes_at_once_are_two_versions(
    store_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = versions(monkeypatch, store_folder)
    assert len(shown) == 2
    assert shown[0] == ["waiting"] * 100


def test_a_server_that_is_away_fails_no_study(
    store_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert versions(monkeypatch, store_folder, away=True) == []


@pytest.mark.parametrize(
    ("name", "key"), [("paper_v1.2", "ablation-paper-v1-2"), ("Tänze", "ablation-tanze")]
)
def test_the_key_has_the_letters_that_prefect_takes(name: str, key: str) -> None:
    assert progress_table.ProgressTable(Study(name=name), []).key == key
