"""What a file promises is counted before it is decoded."""

import io
import resource
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from robojackson.errors import BadTable, StoreError
from robojackson.files import table_door
from robojackson.files.foreign_file import parse_json, read_file
from robojackson.files.memory_limit import limited_memory


def parquet(table: pa.Table) -> bytes:
    sink = io.BytesIO()
    pq.write_table(table, sink)
    return sink.getvalue()


def test_a_table_of_too_many_numbers_is_refused_by_its_footer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(table_door, "MOST_NUMBERS", 1000)
    monkeypatch.setattr(pq, "read_table", lambda *a, **k: pytest.fail("it was decoded"))
    with pytest.raises(BadTable, match="at most 1,000 are read"):
        table_door.read_parquet(parquet(pa.table({"a": np.zeros(1001)})), "f")


def test_one_text_for_every_row_counts_in_every_row(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table_door, "MOST_TEXT", 10_000)
    data = parquet(pa.table({"a": ["x" * 100] * 101}))
    with pytest.raises(BadTable, match="too much text"):
        table_door.read_parquet(data, "f")


def test_nested_json_is_no_json() -> None:
    with pytest.raises(ValueError, match="too deep"):
        parse_json(b"[" * 100_000 + b"]" * 100_000)


def test_a_large_file_and_a_device_are_not_read(tmp_path: Path) -> None:
    with (tmp_path / "a").open("wb") as file:
        file.truncate(2**33)
    with pytest.raises(StoreError, match="at most"):
        read_file(tmp_path / "a")
    with pytest.raises(StoreError, match="a device"):
        read_file(Path("/dev/zero"))


def test_the_ceiling_fails_an_allocation_and_goes_away() -> None:
    before = resource.getrlimit(resource.RLIMIT_DATA)
    with limited_memory(2**26), pytest.raises(MemoryError):
        np.empty(2**30)  # 8 GB: more than the process may have freed before
    assert resource.getrlimit(resource.RLIMIT_DATA) == before
