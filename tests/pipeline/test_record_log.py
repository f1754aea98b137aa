"""Records of a training grow, survive a resume, and drop what no checkpoint knows."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from robojackson.errors import BadTable
from robojackson.files import tables
from robojackson.pipeline.record_log import RecordLog
from robojackson.pipeline.table_schemas import EPISODE_RECORD
from storage import run_catalogue
from storage.store import Store

COMMON = {"run_id": "r", "move": "walk", "setup": "scratch", "seed": 0}


def a_log(store: Store) -> RecordLog:
    return RecordLog(store, "episodes.parquet", EPISODE_RECORD, COMMON)


def episodes(*steps: int) -> list[dict[str, float]]:
    return [
        {"step": s, "episode": i, "episode_return": 1.0, "episode_length": 5}
        for i, s in enumerate(steps)
    ]


def saved_steps(store: Store) -> list[int]:
    data = store.read("episodes.parquet")
    return [row["step"] for row in tables.decode_rows(EPISODE_RECORD, data, "f")]


def test_appended_rows_are_saved_with_the_common_columns(tmp_path: Path) -> None:
    store = Store(tmp_path)
    log = a_log(store)
    log.append(episodes(10))
    log.save()
    row = tables.decode_rows(EPISODE_RECORD, store.read("episodes.parquet"), "f")[0]
    assert {name: row[name] for name in COMMON} == COMMON


def test_a_resumed_log_drops_what_came_after_the_checkpoint(tmp_path: Path) -> None:
    store = Store(tmp_path)
    first = a_log(store)
    first.append(episodes(10, 20, 30, 40))
    first.save()
    second = a_log(store)
    second.append(episodes(25, 35))
    second.append(episodes(45))
    second.save()
    assert saved_steps(store) == [10, 20, 25, 35, 45]


def test_a_log_that_starts_again_has_no_rows_of_the_one_before(tmp_path: Path) -> None:
    store = Store(tmp_path)
    first = a_log(store)
    first.append(episodes(10, 20, 30))
    first.save()
    second = RecordLog(store, "episodes.parquet", EPISODE_RECORD, COMMON, resumes=False)
    assert saved_steps(store) == [10, 20, 30]
    second.append(episodes(25))
    second.save()
    assert saved_steps(store) == [25]


def a_run(name: str, day: int) -> run_catalogue.Run:
    when = datetime(2026, 11, 1, tzinfo=UTC) + timedelta(days=day)
    return run_catalogue.Run(name, "walk", "humanoid", "scratch", 0, when, summary={"skill": 0.5})


def test_the_catalogue_lists_runs_in_time(tmp_path: Path) -> None:
    store = Store(tmp_path)
    for run in (a_run("b", 2), a_run("a", 3), a_run("c", 1)):
        run_catalogue.record(store, run)
    assert [run.run_id for run in run_catalogue.list_runs(store)] == ["c", "b", "a"]


def test_a_run_is_read_as_it_was_recorded(tmp_path: Path) -> None:
    store, run = Store(tmp_path), a_run("a", 1)
    run_catalogue.record(store, run)
    assert run_catalogue.list_runs(store) == [run]


def test_a_damaged_catalogue_file_is_named(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.put("runs/a.json", b'{"run_id": 3}')
    with pytest.raises(BadTable, match=r"runs/a\.json: "):
        run_catalogue.list_runs(store)
