"""The catalogue of all assessed videos: a row an assessment, never changed, only added.

Each refresh writes its rows as one new Parquet file under a name that no other can have, so two
refreshes at once never touch the same file, on a disk or in an object store. Compaction writes what
it read into one file and only then removes the read ones: between the two a row is in two
files, and a reader counts it once by its `record_id`. DuckDB answers questions.
"""

import uuid
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import pyarrow as pa

from robojackson.errors import StoreError
from robojackson.files import tables
from robojackson.files.sql_tables import answering
from robojackson.files.table_door import MOST_NUMBERS, MOST_TEXT
from robojackson.files.table_types import TEXT
from storage.artifact import Artifact
from storage.candidate_record import CANDIDATE_RECORD, TIME
from storage.store import Store

FOLDER = "candidates"
COMPACT_FROM = 32
"""Files from which on a compaction is worth its while."""
ATTEMPTS = 5
"""Readings that may lose a file to a compaction in between."""
Row = Mapping[str, Any]


def append(store: Store, rows: Iterable[Row]) -> Artifact | None:
    """Add assessments; a `record_id` is made for each. None when there are no rows.

    Raises:
        BadTable: a row lacks a column or has one too many, or their texts are too long.
        StoreError: the store refuses the file; nothing of it is left.
    """
    named = [{**row, "record_id": uuid.uuid4().hex} for row in rows]
    return _write(store, "rows", named) if named else None


def records(store: Store, dance: str | None = None) -> list[dict[str, Any]]:
    """Return all assessments, or those of one dance: the oldest search first, in it the chosen
    video, those that may be danced by their score, and the others.
    """
    where = "" if dance is None else "WHERE lower(dance) = lower($dance)"
    given = {} if dance is None else {"dance": dance}
    places = "list_position(['chosen', 'accepted'], decision)"
    ordered = (
        f"ORDER BY decided_at, run_id, {places} NULLS LAST, decision, score_per_second, "
        "stability_score, record_id"
    )
    return _ask(store, f"SELECT * FROM candidates {where} {ordered}", given, limited=False)


def query(store: Store, sql: str, given: Mapping[str, Any] | None = None) -> list[dict[str, Any]]:
    """Return rows of a question in DuckDB's SQL about the table `candidates`; it reaches no other
    file.

    Raises:
        BadTable: the question is not SQL, or names what is not there.
    """
    return _ask(store, sql, given)


def _ask(
    store: Store, sql: str, given: Mapping[str, Any] | None, limited: bool = True
) -> list[dict[str, Any]]:
    known = {"candidates": _distinct(_without_zones(_read_all(store)))}
    with answering("catalogue", known, limited) as ask:
        return [{name: _in_utc(value) for name, value in row.items()} for row in ask(sql, given)]


def compact(store: Store, least: int = COMPACT_FROM) -> list[Artifact]:
    """Write all rows into one file, if there are `least` files or more; any time, beside anything.

    Rows that a reader would refuse in one file become several. Two compactions at once leave rows
    in two files, which the next one puts together.

    Raises:
        BadTable: what was written cannot be read; every file that was there stays.
    """
    keys = _keys(store)
    if len(keys) < max(least, 2):
        return []
    read = {key: rows for key in keys if (rows := _read(store, key)) is not None}
    unique = {row["record_id"]: row for rows in read.values() for row in rows.to_pylist()}
    made = [_write(store, "compact", part) for part in _readable_parts(unique.values())]
    for artifact in made:
        _read(store, artifact.key)
    for key in read:
        store.remove(key)
    return made


def champion(store: Store, dance: str, kind: str = "") -> dict[str, Any] | None:
    """Return the assessment of the video that was chosen last for a dance, if its file still exists
    and it has not failed since.

    Args:
        kind: Beginning of the ids of the runs that count, such as `refresh`.
    """
    return _reigning(store, _of(store, dance, kind))[0]


def known(store: Store, dance: str, kind: str = "") -> set[tuple[str, str]]:
    """Return source and id of every video that was assessed for a dance; a failed one may be tried
    again, and so may a choice whose file was removed, as by `robojackson clean`."""
    found = _of(store, dance, kind)
    return _assessed(found) - _reigning(store, found)[1]


def failed(store: Store, dance: str, kind: str = "") -> set[tuple[str, str]]:
    """Return source and id of every video that could never be assessed for a dance."""
    found = _of(store, dance, kind)
    return {_key_of(row) for row in found} - _assessed(found)


def accepted(store: Store, dance: str, kind: str = "") -> list[dict[str, Any]]:
    """Return the last assessments of the videos that may be danced and were never chosen, whose
    files exist."""
    last = {_key_of(row): row for row in _of(store, dance, kind)}
    fit = [row for row in last.values() if row["decision"] == "accepted" and row["video_key"]]
    return [row for row in fit if store.exists(row["video_key"])]


def _of(store: Store, dance: str, kind: str) -> list[dict[str, Any]]:
    return [row for row in records(store, dance) if row["run_id"].startswith(kind)]


def _reigning(
    store: Store, found: Sequence[Row]
) -> tuple[dict[str, Any] | None, set[tuple[str, str]]]:
    """Return the last choice whose file exists, and the later ones whose files do not."""
    failed: set[tuple[str, str]] = set()
    later: set[tuple[str, str]] = set()
    lost: set[tuple[str, str]] = set()
    for row in reversed(found):
        key = _key_of(row)
        if row["decision"] == "failed":
            failed.add(key)
        if row["decision"] == "chosen" and key not in failed and row["video_key"]:
            if store.exists(row["video_key"]):
                return dict(row), lost
            lost |= {key} - later  # unless it was assessed again since
        later.add(key)
    return None, lost


def _assessed(found: Iterable[Row]) -> set[tuple[str, str]]:
    return {_key_of(row) for row in found if row["decision"] != "failed"}


def _key_of(row: Row) -> tuple[str, str]:
    return row["source"], row["video_id"]


def _write(store: Store, kind: str, rows: Sequence[Row]) -> Artifact:
    when = datetime.now(UTC).strftime("%Y%m%dT%H%M%S%f")
    key = f"{FOLDER}/{kind}-{when}-{uuid.uuid4().hex[:12]}.parquet"
    data = tables.encode_rows(CANDIDATE_RECORD, rows)
    tables.decode_table(CANDIDATE_RECORD, data, store.address(key))  # a bad file harms all others
    return store.put(key, data)


def _readable_parts(rows: Iterable[Row]) -> Iterator[list[Row]]:
    """Yield the rows in lists of which each is within the limits of a reader."""
    names = [c.name for c in CANDIDATE_RECORD.columns if c.type == TEXT]
    most = MOST_NUMBERS // len(CANDIDATE_RECORD.columns)
    part: list[Row] = []
    longest = 1
    for row in rows:
        size = max(len((row[name] or "").encode()) for name in names)
        longest = max(longest, size)
        if part and (len(part) == most or longest * (len(part) + 1) > MOST_TEXT):
            yield part
            part, longest = [], max(size, 1)
        part.append(row)
    if part:
        yield part


def _keys(store: Store) -> list[str]:
    return [key for key in store.list(FOLDER) if key.endswith(".parquet")]


def _read_all(store: Store) -> pa.Table:
    """Return all files in one table; read again when a compaction removed one meanwhile."""
    for _ in range(ATTEMPTS):
        parts = [_read(store, key) for key in _keys(store)]
        whole = [part for part in parts if part is not None]
        if len(whole) == len(parts):
            return pa.concat_tables([_empty(), *whole])
    raise StoreError(f"{store.address(FOLDER)}: is compacted again and again while it is read")


def _read(store: Store, key: str) -> pa.Table | None:
    """Return one file, None when it is gone."""
    try:
        data = store.read(key)
    except StoreError:
        if store.exists(key):
            raise
        return None
    return tables.decode_table(CANDIDATE_RECORD, data, store.address(key))


def _distinct(table: pa.Table) -> pa.Table:
    """Return the rows, each `record_id` once."""
    numbered = table.select(["record_id"]).append_column("row", pa.array(range(len(table))))
    first = numbered.group_by("record_id", use_threads=False).aggregate([("row", "min")])
    return table.take(first.column("row_min"))


def _without_zones(table: pa.Table) -> pa.Table:
    """Return the times as DuckDB takes them without its extension for time zones; they all are
    UTC."""
    columns = [
        column.cast(pa.timestamp("us")) if column.type == TIME else column
        for column in table.itercolumns()
    ]
    return pa.table(columns, names=table.column_names)


def _in_utc(value: Any) -> Any:
    return value.replace(tzinfo=UTC) if isinstance(value, datetime) else value


def _empty() -> pa.Table:
    return tables.decode_table(CANDIDATE_RECORD, tables.encode_rows(CANDIDATE_RECORD, []), "")
