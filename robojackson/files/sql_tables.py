"""SQL queries (DuckDB) on tables in memory, without access to other files and with limits.

Threads, memory, time and rows of a query are limited. DuckDB's own memory limit does not count
every string, so the whole process gets a ceiling as well while a query runs.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from decimal import Decimal
from threading import Timer
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from robojackson.errors import BadTable
from robojackson.files import tables
from robojackson.files.memory_limit import limited_memory

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

Rows = list[dict[str, Any]]
Given = Mapping[str, object]
RunQuery = Callable[..., Rows]
"""Run a query in SQL with its parameters and return rows."""
LIMITS: dict[str, str | bool | int | float | list[str]] = {
    "threads": 1,
    "memory_limit": "384MB",
    "temp_directory": "",
    "max_temp_directory_size": "0B",
    "autoinstall_known_extensions": False,
    "autoload_known_extensions": False,
}
MOST_SECONDS = 30.0
MOST_ROWS = 100_000
MOST_MEMORY = 2**29
ASKING = frozenset({"SELECT", "EXPLAIN", "PRAGMA", "CALL", "MULTI"})
"""DuckDB's types of statements that answer with rows; `MULTI` is a `PIVOT`."""
OF_ALL = {"query", "query_table", "columns", "duckdb_columns", "show", "describe", "summarize"}
"""Words of questions that may read a table without its name, or list its columns."""


@contextmanager
def answering(
    about: str, known: Mapping[str, pa.Table], limited: bool = True
) -> Iterator[RunQuery]:
    """Yield a function that runs queries on tables by name.

    Args:
        about: Name of the tables in errors.
        limited: Whether queries have limits; false where the queries are our own.
    """
    import duckdb

    with duckdb.connect(":memory:", config=LIMITS if limited else {}) as connection:
        for name, rows in known.items():
            connection.register(name, rows)  # a view: a copy would count as memory of the query
        connection.execute("SET enable_external_access = false")
        connection.execute("SET lock_configuration = true")

        def run_query(sql: str, given: Given | None = None) -> Rows:
            try:
                if not limited:
                    return _rows(connection, sql, given or {}, most=None)
                with _limits(connection):
                    _require_query(connection, sql)
                    return _rows(connection, sql, given or {}, MOST_ROWS)
            except duckdb.InterruptException as cause:
                raise BadTable(
                    f"{about}: no answer in {MOST_SECONDS:g} s; reduce the query"
                ) from cause
            except (duckdb.OutOfMemoryException, MemoryError) as cause:
                raise BadTable(
                    f"{about}: the answer takes too much memory; reduce the query"
                ) from cause
            except (duckdb.Error, RuntimeError, ValueError, OverflowError) as cause:
                raise BadTable(f"{about}: {' '.join(str(cause).split())}"[:2000]) from cause

        yield run_query


def named_in(sql: str, known: Iterable[str]) -> set[str]:
    """Return the tables that a question may read: those whose names are in it, or, where a name may
    be put together or the columns of all are listed, all."""
    words = set(re.findall(r"\w+", sql.lower()))
    return set(known) if words & OF_ALL else words & set(known)


@contextmanager
def _limits(connection: "DuckDBPyConnection") -> Iterator[None]:
    timer = Timer(MOST_SECONDS, connection.interrupt)
    timer.daemon = True
    timer.start()
    try:
        with limited_memory(MOST_MEMORY):
            yield
    finally:
        timer.cancel()


def _require_query(connection: "DuckDBPyConnection", sql: str) -> None:
    statements = connection.extract_statements(sql)
    kind = statements[-1].type.name if statements else "SELECT"
    if kind not in ASKING:
        raise BadTable(f"the last statement is {kind}, which has no rows; end with a SELECT")


def _rows(connection: "DuckDBPyConnection", sql: str, given: Given, most: int | None) -> Rows:
    if connection.execute(sql, dict(given)) is None:
        raise BadTable("there is no query in the text")
    names = [column[0] for column in connection.description or ()]
    tables.require_distinct(names)
    if not names:
        return []
    found = connection.fetchall() if most is None else connection.fetchmany(most + 1)
    if most is not None and len(found) > most:
        raise BadTable(f"more than {most:,} rows; use LIMIT, or aggregate them")
    return [dict(zip(names, map(_plain, row), strict=True)) for row in found]


def _plain(value: object) -> object:
    """Return a value of DuckDB with its decimals as numbers and its bytes in hexadecimal."""
    if isinstance(value, Decimal):
        return int(value) if value == value.to_integral_value() else float(value)
    if isinstance(value, bytes):
        return value.hex()
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, dict):
        return {_plain(key): _plain(inner) for key, inner in value.items()}
    return value
