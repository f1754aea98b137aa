"""The record of a call is found without running it, wherever the call was made."""

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from prefect import flow
from prefect.settings import PREFECT_HOME, PREFECT_LOCAL_STORAGE_PATH, temporary_settings

from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.stage import NotRecorded, labelled, records_only, stage

ran: list[int] = []


@stage(unkeyed=("label",))
async def doubled(number: int, label: str = "") -> dict[str, Artifact]:
    ran.append(number)
    return {"value": Store.from_environment().put(f"{number}.txt", str(2 * number).encode())}


def recorded(number: int, first: bool) -> Any:
    """Return the record of a call that was made before, or was not."""

    @flow
    async def calling() -> None:
        await doubled(number, label="x")

    if first:
        asyncio.run(calling())
    return doubled.recorded(number=number)


@pytest.fixture(autouse=True)
def _empty(records: None, store_folder: Path) -> None:
    ran.clear()


@pytest.mark.medium
def test_a_call_that_was_made_is_recorded(store_folder: Path) -> None:
    assert recorded(3, first=True) == {"value": Store(store_folder).put("3.txt", b"6")}


@pytest.mark.medium
def test_a_call_that_was_not_made_is_not_and_nothing_runs() -> None:
    assert recorded(4, first=False) is None
    assert ran == []


@pytest.mark.medium
def test_a_call_whose_file_is_gone_is_not_recorded(store_folder: Path) -> None:
    recorded(5, first=True)
    (store_folder / "5.txt").unlink()
    assert recorded(5, first=False) is None


@pytest.mark.medium
def test_a_call_whose_file_was_altered_is_not_recorded(store_folder: Path) -> None:
    recorded(6, first=True)
    (store_folder / "6.txt").write_text("13")
    assert recorded(6, first=False) is None


@pytest.mark.medium
def test_a_record_answers_a_call_in_place_of_a_run(store_folder: Path) -> None:
    made = recorded(7, first=True)
    ran.clear()
    with records_only():
        assert asyncio.run(doubled(7)) == made
    assert ran == []


@pytest.mark.medium
def test_a_call_without_a_record_is_refused_where_nothing_may_run() -> None:
    with records_only(), pytest.raises(NotRecorded):
        asyncio.run(doubled(8))
    assert ran == []


@pytest.mark.medium
@pytest.mark.parametrize("text", ["", "[]", "{}", '{"result": "{"}', '{"result": 3}', "[" * 10**5])
def test_a_damaged_record_is_no_record(store_folder: Path, text: str) -> None:
    recorded(9, first=True)
    (path,) = (store_folder / "records" / "doubled").glob("*.json")
    path.write_text(text)
    assert doubled.recorded(number=9) is None


@pytest.mark.medium
def test_records_lie_where_the_store_says_whatever_home_prefect_has(
    store_folder: Path, tmp_path: Path
) -> None:
    elsewhere = {PREFECT_HOME: tmp_path / "home", PREFECT_LOCAL_STORAGE_PATH: tmp_path / "results"}
    with temporary_settings(elsewhere):
        recorded(10, first=True)
    assert doubled.recorded(number=10) is not None
    assert not (tmp_path / "results").exists()


@pytest.mark.medium
def test_a_record_whose_address_an_earlier_version_wrote_is_found(store_folder: Path) -> None:
    recorded(13, first=True)
    (path,) = (store_folder / "records" / "doubled").glob("*.json")
    record = json.loads(path.read_text())
    assert record["metadata"]["storage_key"] == f"robojackson://records/doubled/{path.name}"
    record["metadata"]["storage_key"] = f"doubled/{path.name}"
    path.write_text(json.dumps(record))
    ran.clear()
    recorded(13, first=True)
    assert ran == []


@pytest.mark.medium
def test_a_record_in_an_object_store_is_found_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROBOJACKSON_STORE", "memory://records")
    assert recorded(11, first=True) is not None
    assert Store("memory://records").list("records/doubled")


@pytest.mark.medium
def test_task_runs_are_named_after_what_they_work_on() -> None:
    with labelled("scratch-walk-s0"):
        assert doubled.run_name() == "doubled-scratch-walk-s0"
