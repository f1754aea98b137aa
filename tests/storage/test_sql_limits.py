"""A question in SQL ends, and takes no more memory than it may."""

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from robojackson.errors import BadTable
from robojackson.files import sql_tables
from storage import study_tables
from storage.store import Store


@pytest.mark.parametrize(
    ("sql", "message"),
    [
        ("SELECT repeat('x', 2000000000)", "memory"),
        ("SELECT list(range) FROM range(400000000)", "memory"),
        ("SELECT * FROM range(200000)", "100,000 rows"),
        ("SET memory_limit = '9GB'; SELECT 1", "locked"),
        ("SET memory_limit = '9GB'", "SET, which has no rows"),
        ("DROP TABLE runs", "DROP, which has no rows; end with a SELECT"),
        ("--", "no query"),
    ],
)
def test_a_question_has_limits(sql: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(BadTable, match=message):
        study_tables.query(Store(tmp_path), sql)


def test_tables_may_be_larger_than_the_memory_of_a_question(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sql_tables.LIMITS, "memory_limit", "16MB")
    rows = pa.table({"survived_s": np.ones(4_000_000)})
    with sql_tables.answering("metrics", {"episodes": rows}) as ask:
        assert ask("SELECT sum(survived_s) AS n FROM episodes") == [{"n": 4e6}]
        with pytest.raises(BadTable, match="takes too much memory; reduce the query"):
            ask("SELECT list(survived_s) AS n FROM episodes")


@pytest.mark.parametrize(
    ("sql", "expected"),
    [("1.25", 1.25), ("sum(0.5 * range)", 3), ("avg(range)::DECIMAL(4, 2)", 1.5),
     ("[0.5, 2.0]", [0.5, 2]), ("{'a': 0.5}", {"a": 0.5}), ("'\\x0F\\xA0'::BLOB", "0fa0")],
)  # fmt: skip
def test_a_decimal_is_a_number_and_bytes_are_hexadecimal(
    sql: str, expected: object, tmp_path: Path
) -> None:
    (row,) = study_tables.query(Store(tmp_path), f"SELECT {sql} AS x FROM range(4) LIMIT 1")
    assert json.loads(json.dumps(row)) == {"x": expected}
    assert type(row["x"]) is type(expected)


def test_a_question_without_end_is_interrupted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sql_tables, "MOST_SECONDS", 0.3)
    with pytest.raises(BadTable, match=r"no answer in 0\.3 s"):
        study_tables.query(Store(tmp_path), "SELECT count(*) FROM range(10000000) a, range(9999) b")


@pytest.mark.parametrize(
    ("sql", "expected"),
    [("SELECT 1 FROM Runs", {"runs"}), ("SELECT * FROM information_schema.columns", {"runs", "b"}),
     ("DESCRIBE", {"runs", "b"}), ("SELECT 1", set())],
)  # fmt: skip
def test_a_question_about_columns_reads_all_tables(sql: str, expected: set[str]) -> None:
    assert sql_tables.named_in(sql, ("runs", "b")) == expected
