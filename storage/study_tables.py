"""The tables of the studies: episodes and evaluations of every cell, one file a cell and table; and
the beats of dances to music, as the study `dances`.

    metrics/episodes/study=S/move=M/setup=P/seed=N/<run_id>.parquet
    metrics/evaluations/study=S/move=M/setup=P/seed=N/<run_id>.parquet
    metrics/beats/study=dances/move=M/setup=P/seed=N/<run_id>.parquet
    metrics/runs/<run_id>-<study>.json           where the numbers come from

The run id is a digest of the configuration and the inputs, so a cell that is done again writes the
same bytes under the same key, two writers never touch one file, and no clock stands in a table;
when and where a cell ran is in the file beside it. DuckDB answers questions about all of them.
"""

import json
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import pyarrow as pa

from robojackson.errors import BadTable, StoreError
from robojackson.files import tables
from robojackson.files.local_folder import sha256_of
from robojackson.files.sql_tables import RunQuery, answering, named_in
from robojackson.files.table_types import TableSchema
from robojackson.pipeline.table_schemas import BEAT_RECORD, EPISODE_RECORD, EVALUATION_RECORD
from storage.artifact import Artifact
from storage.store import Store

FOLDER = "metrics"
CELL: Mapping[str, TableSchema] = {"episodes": EPISODE_RECORD, "evaluations": EVALUATION_RECORD}
"""Tables that every cell of a study has."""
TABLES = {**CELL, "beats": BEAT_RECORD}
DANCES = "dances"
"""Study of the passes of `robojackson dance`."""
RUNS = f"{FOLDER}/runs"
Runs = Collection[str] | None
"""Ids of the runs whose rows count; all of them if absent."""
ALL = (*TABLES, "runs")
"""Names of the tables in questions."""
ALWAYS = ("run_id", "study", "move", "setup", "config")
"""Columns of `runs` that always exist."""


@dataclass(frozen=True)
class Place:
    """Place of the rows of a cell.

    Attributes:
        study, move, setup, seed: The partition.
        run_id: Run id of the training.
    """

    study: str
    move: str
    setup: str
    seed: int
    run_id: str

    def key(self, table: str) -> str:
        """Return the key of one of its tables."""
        partition = f"study={self.study}/move={self.move}/setup={self.setup}/seed={self.seed}"
        return f"{FOLDER}/{table}/{partition}/{self.run_id}.parquet"


def write(store: Store, place: Place, given: Mapping[str, Artifact]) -> dict[str, Artifact]:
    """Write the tables of a cell where queries find them; replace those of another run of it.

    A table that is there already is not written again.

    Args:
        given: `episodes` and `evaluations`, as the stages left them.
    Raises:
        BadTable: one does not match its schema.
        StoreError: the store refuses it; nothing half-written is left.
    """
    made = {}
    for table, schema in CELL.items():
        key = given[table].key
        rows = tables.decode_rows(schema, store.read(key), store.address(key))
        made[table] = _put(
            store, place.key(table), tables.encode_rows(schema, relabelled(place, rows))
        )
    for key in _outdated(store, place):
        for old in (key, note_key(replace(place, run_id=_run(key)))):
            if store.exists(old):
                store.remove(old)
    return made


def write_beats(store: Store, place: Place, rows: list[dict[str, Any]]) -> Artifact:
    """Write how the motions of a dance meet its music."""
    content = tables.encode_rows(BEAT_RECORD, relabelled(place, rows))
    return _put(store, place.key("beats"), content)


def note_key(place: Place) -> str:
    """Return the key of a cell's provenance."""
    return f"{RUNS}/{place.run_id}-{place.study}.json"


def read_note(store: Store, place: Place) -> dict[str, Any]:
    """Return a cell's provenance; empty where it is missing or cannot be read."""
    try:
        return dict(json.loads(store.read(note_key(place))))
    except (StoreError, ValueError):
        return {}


def note(store: Store, place: Place, facts: Mapping[str, Any]) -> Artifact:
    """Store the provenance of a cell."""
    text = json.dumps(facts, indent=1, sort_keys=True, default=str)
    return store.put(note_key(place), text.encode())


def query(store: Store, sql: str, given: Mapping[str, Any] | None = None) -> list[dict[str, Any]]:
    """Return rows of a question in SQL about `episodes`, `evaluations`, `beats` and `runs`.

    It reaches no other file.

    Raises:
        BadTable: the question is not SQL, or names what is not there.
    """
    with answering("metrics", _tables(store, named_in(sql, ALL))) as ask:
        return ask(sql, given)


@contextmanager
def opened(store: Store, study: str | None = None, runs: Runs = None) -> Iterator[RunQuery]:
    """Yield a query function over all tables, or those of a study or of some of its runs, read once
    for any number of questions.
    """
    with answering("metrics", _tables(store, ALL, study, runs), limited=False) as ask:
        yield ask


def _tables(
    store: Store, named: Collection[str], study: str | None = None, runs: Runs = None
) -> dict[str, pa.Table]:
    """Return the tables of the cells, those that are not named without rows."""
    counted: dict[str, Runs] = {table: runs if table in named else () for table in ALL}
    held = {table: read(store, table, study, counted[table]) for table in TABLES}
    return held | {"runs": _runs(store, study, counted["runs"])}


def files_of(store: Store, study: str, runs: Runs = None) -> list[Artifact]:
    """Return all files of a study, or of some runs of it: its tables and where they come from."""
    keys = [key for table in TABLES for key in store.list(f"{FOLDER}/{table}/study={study}")]
    keys = [key for key in keys if runs is None or _run(key) in runs]
    return [Artifact(key=k, sha256=store.sha256(k)) for k in [*keys, *_notes(store, study, runs)]]


def runs_of(files: Iterable[Artifact]) -> set[str]:
    """Return the ids of the runs whose tables are among the files."""
    return {_run(file.key) for file in files if file.key.endswith(".parquet")}


def read(store: Store, table: str, study: str | None = None, runs: Runs = None) -> pa.Table:
    """Return all rows of a table, with the column `study`, or those of one study or of some
    runs. A file of joined cells has the rows of those that have no file."""
    schema = TABLES[table]
    prefix = f"{FOLDER}/{table}" + (f"/study={study}" if study else "")
    listed = store.list(prefix) if runs is None or len(runs) else []
    keys = [key for key in listed if key.endswith(".parquet")]
    parts = []
    for key in keys:
        if runs is not None and _run(key) not in runs and not _is_joined(key):
            continue
        part = _with_study(tables.decode_table(schema, store.read(key), store.address(key)), key)
        if _is_joined(key):
            inside = f"{key.rpartition('/')[0]}/move="
            cells = {_run(one) for one in keys if one.startswith(inside)}
            names = part.column("run_id").to_pylist()
            counted = [name not in cells and (runs is None or name in runs) for name in names]
            part = part.filter(pa.array(counted, pa.bool_()))
        parts.append(part)
    return pa.concat_tables([_empty(schema), *parts], promote_options="default")


def _is_joined(key: str) -> bool:
    return "/move=" not in key  # as docs/scaling.md joins the cells of a study


def relabelled(place: Place, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return rows under the names of this cell: a cached table may have been made under others."""
    names = {"run_id": place.run_id, "move": place.move, "setup": place.setup, "seed": place.seed}
    return [{**row, **names} for row in rows]


def _with_study(table: pa.Table, key: str) -> pa.Table:
    study = key.split("study=", 1)[1].split("/", 1)[0]
    bare = table.replace_schema_metadata(None)
    return bare.add_column(0, "study", pa.array([study] * len(table), pa.string()))


def _empty(schema: TableSchema) -> pa.Table:
    whole = tables.decode_table(schema, tables.encode_rows(schema, []), "")
    bare = whole.replace_schema_metadata(None)
    return bare.add_column(0, "study", pa.array([], pa.string()))


def _put(store: Store, key: str, content: bytes) -> Artifact:
    digest = sha256_of(content)
    there = store.exists(key) and store.sha256(key) == digest
    return Artifact(key=key, sha256=digest) if there else store.put(key, content)


def _run(key: str) -> str:
    return key.rpartition("/")[2].removesuffix(".parquet")


def _notes(store: Store, study: str | None, runs: Runs) -> list[str]:
    """Return the keys of the cells' provenance; one of another study may be among them."""
    found = [key for key in store.list(RUNS) if study is None or key.endswith(f"-{study}.json")]
    if runs is None:
        return found
    note_names = {f"{run}-{study}.json" for run in runs}
    return [key for key in found if key.rpartition("/")[2] in note_names]


def _runs(store: Store, study: str | None, runs: Runs) -> pa.Table:
    """Return the provenance, a row a cell: what is not a plain value stands as JSON."""
    rows = []
    for key in _notes(store, study, runs):
        try:
            facts = json.loads(store.read(key))
        except (StoreError, ValueError) as cause:
            raise BadTable(f"{store.address(key)}: not JSON: {cause}") from cause
        rows.append({name: _as_text(value) for name, value in facts.items()})
    names = dict.fromkeys([*ALWAYS, *(n for row in rows for n in row)])
    return pa.table({n: pa.array([row.get(n) for row in rows], pa.string()) for n in names})


def _as_text(value: Any) -> str | None:
    """Return a value of the provenance for a column of text: text itself, all else as JSON."""
    if value is None or isinstance(value, str):
        return value
    return json.dumps(value, sort_keys=True, default=str)


def _outdated(store: Store, place: Place) -> list[str]:
    """Return the files of the same cell under another run id: an earlier configuration or code."""
    found = []
    for table in CELL:
        folder = place.key(table).rsplit("/", 1)[0]
        found += [key for key in store.list(folder) if key != place.key(table)]
    return found
