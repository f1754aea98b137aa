"""Whether a stage is cached is known without running it."""

import asyncio
from pathlib import Path
from typing import Any

import pytest
from prefect import flow

from storage.artifact import Artifact
from storage.store import Store
from tasks.caching import stage
from tasks.kept import kept

ran: list[int] = []


@stage(unkeyed=("label",))
async def doubled(number: int, label: str = "") -> dict[str, Artifact]:
    ran.append(number)
    return {"value": Store.from_environment().put(f"{number}.txt", str(2 * number).encode())}


def asked(number: int, first: bool) -> Any:
    """What is kept of a call, made before or not."""

    @flow
    async def ask() -> Any:
        if first:
            await doubled(number, label="x")
        return await kept(doubled, number=number)

    return asyncio.run(ask())


@pytest.fixture(autouse=True)
def _empty(records: Path, store_folder: Path) -> None:
    ran.clear()


def test_a_call_that_was_made_is_kept(store_folder: Path) -> None:
    assert asked(3, first=True) == {"value": Store(store_folder).put("3.txt", b"6")}


def test_a_call_that_was_not_made_is_not_and_nothing_runs() -> None:
    assert asked(4, first=False) is None
    assert ran == []


def test_a_call_whose_file_is_gone_is_not_kept(store_folder: Path) -> None:
    asked(5, first=True)
    (store_folder / "5.txt").unlink()
    assert asked(5, first=False) is None


def test_a_call_whose_file_was_altered_is_not_kept(store_folder: Path) -> None:
    asked(6, first=True)
    (store_folder / "6.txt").write_text("13")
    assert asked(6, first=False) is None
