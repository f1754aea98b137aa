"""Questions in DuckDB's SQL about tables in memory: no other file is reached, no question endless.

Threads, memory, time and rows of a question have limits. DuckDB's own memory limit does not count
every string, so the whole process gets a ceiling as well while it answers.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
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
"""A question in SQL and its parameters to rows."""
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


@contextmanager
def answering(
    about: str, known: Mapping[str, pa.Table], limited: bool = True
) -> Iterator[RunQuery]:
    """Tables by name, to which any number of questions can be put.

    Args:
        about: What the tables are, for errors.
        limited: Whether an answer has limits; false where the questions are our own.
    """
    import duckdb

    with duckdb.connect(":memory:", config=LIMITS if limited else {}) as connection:
        for name, rows in known.items():
            connection.register("given", rows)
            connection.execute(f"CREATE TABLE {name} AS SELECT * FROM given")
            connection.unregister("given")
        connection.execute("SET enable_external_access = false")
        connection.execute("SET lock_configuration = true")

        def ask(sql: str, given: Given | None = None) -> Rows:
            try:
                if not limited:
                    return _rows(connection, sql, given or {}, most=None)
                with _limits(connection):
                    return _rows(connection, sql, given or {}, MOST_ROWS)
            except duckdb.InterruptException as cause:
                raise BadTable(f"{about}: no answer in {MOST_SECONDS:g} s; ask for less") from cause
            except (duckdb.OutOfMemoryException, MemoryError) as cause:
                raise BadTable(f"{about}: the answer takes too much memory; ask less") from cause
            except (duckdb.Error, RuntimeError, ValueError, OverflowError) as cause:
                raise BadTable(f"{about}: {' '.join(str(cause).split())}"[:2000]) from cause

        yield ask


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


def _rows(connection: "DuckDBPyConnection", sql: str, given: Given, most: int | None) -> Rows:
    if connection.execute(sql, dict(given)) is None:
        raise BadTable("there is no question in the text")
    names = [column[0] for column in connection.description or ()]
    tables.require_distinct(names)
    if not names:
        return []
    found = connection.fetchall() if most is None else connection.fetchmany(most + 1)
    if most is not None and len(found) > most:
        raise BadTable(f"more than {most:,} rows; ask for fewer (LIMIT), or aggregate them")
    return [dict(zip(names, row, strict=True)) for row in found]
