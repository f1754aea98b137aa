"""What killed flows left is taken away by the next flow, whichever it is."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from flows.dance import dance
from flows.find import find
from flows.refresh import refresh
from robojackson.errors import RoboJacksonError
from storage.store import Store


@pytest.mark.parametrize(
    "flow",
    [
        lambda: dance.fn("gone.mp4"),
        lambda: find.fn("nothing", {}),
        lambda: refresh.fn(["a dance that nobody knows"]),
    ],
    ids=["dance", "find", "refresh"],
)
def test_a_flow_takes_away_what_killed_ones_left_and_no_work_of_cells(
    flow: Callable[[], Any], store_folder: Path
) -> None:
    """The flows are refused for their input right after they have begun."""
    store = Store(store_folder)
    work = store.work("evaluate-1") / "evaluate.yaml"
    for path in (work, store_folder / ".part-1", store.work("scratch/dead") / ".held"):
        path.write_bytes(b"half")
    with pytest.raises(RoboJacksonError):
        asyncio.run(flow())
    assert [path for path in store_folder.rglob("*") if path.is_file()] == [work]
