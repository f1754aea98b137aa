"""Read Parquet tables from outside: check the declared size first, then the schema.

Before anything is decoded, the footer gives the number of values; text is read as indices into a
list of distinct values, since a few bytes can declare the same long text for every row.
"""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from pydantic import ValidationError

from robojackson.errors import BadTable
from robojackson.files.file_kinds import NETWORKS, kind_of
from robojackson.files.foreign_file import parse_json, refuse_video
from robojackson.files.table_types import Column, Facts, TableSchema

MAKERS = {"SmplSequence": "mocap", "ReferenceMotion": "retarget"}
"""The command that writes each table that other commands read."""
POLICY_FIRST = "the policy comes first: `robojackson evaluate POLICY REFERENCE`"
NAMES = {
    "LandmarkTrack": ("landmarks.parquet",),
    "SmplSequence": ("smpl.parquet",),
    "ReferenceMotion": ("reference.parquet",),
}
"""The name that each of these tables has in the folder of a stage."""
MOST_NUMBERS = 2**25
"""Largest number of values in one table, nulls included: 17 minutes of SMPL at 120 frames a
second."""
MOST_TEXT = 2**28
"""Largest size of the text in one column, all rows counted, bytes."""


def read_parquet(data: bytes, where: str) -> pa.Table:
    """Return the table of a Parquet file whose declared size is within the limits.

    Raises:
        BadTable: not Parquet, damaged, or too large.
    """
    with _parquet(data, where):
        plain = pq.ParquetFile(io.BytesIO(data))
        text = _text_columns(plain, where)
        # Small files; a thread may outlive this process.
        found = pq.read_table(io.BytesIO(data), read_dictionary=text, use_threads=False)
        for name in text:
            _require_little(found.column(name), name, where)
        return found.cast(plain.schema_arrow)


def column_names(data: bytes, where: str | Path) -> list[str]:
    """Return the names of the columns of a Parquet file.

    Raises:
        BadTable: not Parquet, or damaged.
    """
    with _parquet(data, where):
        return list(pq.read_schema(io.BytesIO(data)).names)


@contextmanager
def _parquet(data: bytes, where: str | Path) -> Iterator[None]:
    """Raise BadTable where the data are of no Parquet file."""
    refuse_video(data, where)
    try:
        yield
    except (pa.ArrowException, OSError, ValueError) as cause:
        if kind := kind_of(data):
            order = f"; {POLICY_FIRST}" if kind == NETWORKS else ""
            raise BadTable(f"{kind}, not a table (Parquet){order}", where) from cause
        reason = " ".join(str(cause).split())[:120]
        raise BadTable(f"not a Parquet file ({reason})", where) from cause


def _text_columns(file: pq.ParquetFile, where: str) -> list[str]:
    """Raise for too many numbers; return the columns of text."""
    footer = file.metadata
    groups = [footer.row_group(i) for i in range(footer.num_row_groups)]
    held = sum(g.column(i).num_values for g in groups for i in range(g.num_columns))
    if max(held, footer.num_rows) > MOST_NUMBERS:
        raise BadTable(
            f"{footer.num_rows:,} rows with {held:,} numbers; at most {MOST_NUMBERS:,} are read: "
            "split it",
            where,
        )
    text = []
    for field in file.schema_arrow:
        items = field.type.value_type if pa.types.is_fixed_size_list(field.type) else field.type
        if pa.types.is_string(field.type):
            text.append(field.name)
        elif not (pa.types.is_primitive(items) or pa.types.is_null(items)):
            raise BadTable(
                f"column {field.name[:80]!r} is {field.type}, neither numbers nor text", where
            )
    return text


def _require_little(column: pa.ChunkedArray, name: str, where: str) -> None:
    longest = [pc.max(pc.binary_length(chunk.dictionary)).as_py() or 0 for chunk in column.chunks]
    if max([0, *longest]) * len(column) > MOST_TEXT:
        raise BadTable(f"column {name!r} holds too much text; at most {MOST_TEXT:,} bytes", where)


def check(schema: TableSchema, table: pa.Table, where: str) -> pa.Table:
    """Return the table itself, if it matches its schema.

    Raises:
        BadTable: the message names the column (or metadata key), what is wrong and the file.
    """
    _require_same(schema, table, where)
    names = table.column_names
    for name in (column.name for column in schema.columns):
        if names.count(name) != 1:
            problem = "is missing" if name not in names else f"occurs {names.count(name)} times"
            raise BadTable(
                f"column {name!r} of {schema.name} {problem}. It has: {', '.join(names)[:400]}",
                where,
            )
    for name in names:
        _check_column(require_known(schema, name, where), table, where)
    for key in schema.metadata:
        if key not in metadata_of(table):
            raise BadTable(f"metadata key {key!r} of {schema.name} is missing", where)
    return table


def facts_of(schema: TableSchema, table: pa.Table, where: str) -> Facts:
    """Return the metadata of a table that its schema declares.

    Raises:
        BadTable: a value does not match the schema.
    """
    found = {key: value for key, value in metadata_of(table).items() if key in schema.facts}
    for key, value in found.items():
        try:
            schema.facts[key].validate_python(value)
        except ValidationError as cause:
            error = cause.errors()[0]
            place = ".".join(map(str, (key, *error["loc"])))
            problem = f"{place} is {error['input']!r:.80}: {error['msg']}"
            raise BadTable(f"metadata of {schema.name} is wrong: {problem}", where) from cause
    return found


def metadata_of(table: pa.Table) -> Facts:
    """Return the metadata of a whole table; values that are not JSON are left out."""
    facts: Facts = {}
    for key, value in (table.schema.metadata or {}).items():
        try:
            facts[key.decode()] = parse_json(value)
        except ValueError:
            continue
    return facts


def require_known(schema: TableSchema, name: str, where: str = "rows") -> Column:
    """Return a column of the schema.

    Raises:
        BadTable: the schema has no column of that name.
    """
    column = schema.column(name)
    if column is None:
        known = [c.name for c in schema.columns] + [f"{start}*" for start in schema.dynamic or {}]
        raise BadTable(
            f"column {name[:80]!r} is not one of {schema.name}. Known: {', '.join(known)}", where
        )
    return column


def numbers_of(column: Column, table: pa.Table, where: str) -> np.ndarray:
    """Return a column as an array of finite numbers within its bounds, NaN rows where it is null.

    Raises:
        BadTable: a number is not finite, or out of bounds.
    """
    array = table.column(column.name).combine_chunks()
    if not column.is_vector:
        values: np.ndarray = array.to_numpy(zero_copy_only=False)
    else:
        width = array.type.list_size
        rows = array.fill_null([np.nan] * width) if array.null_count else array
        values = rows.flatten().to_numpy(zero_copy_only=False).reshape(len(array), width)
    if values.dtype.kind == "f" and not array.null_count and not np.isfinite(values).all():
        raise BadTable(f"column {column.name!r} holds NaN or infinite numbers", where)
    if values.dtype.kind in "fiu" and values.size:
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        if not np.isnan(low) and not column.least <= low <= high <= column.most:
            raise BadTable(
                f"column {column.name!r} holds {low:g} to {high:g}, allowed are {column.least:g} "
                f"to {column.most:g} {column.unit}".rstrip(),
                where,
            )
    return values


def _require_same(schema: TableSchema, table: pa.Table, where: str) -> None:
    found = metadata_of(table).get("table", schema.name)
    if found != schema.name:
        maker = MAKERS.get(schema.name)
        hint = f"; `robojackson {maker}` writes one" if maker else ""
        held, wanted = _with_article(str(found)[:80]), _with_article(schema.name)
        raise BadTable(f"holds {held}, expected {wanted}{hint}", where)


def _with_article(name: str) -> str:
    return f"{'an' if name[:1] in 'AEIO' else 'a'} {name}"


def _check_column(column: Column, table: pa.Table, where: str) -> None:
    found = table.column(column.name)
    declared = column.field().type
    same = (
        pa.types.is_fixed_size_list(found.type)
        and found.type.value_type == column.type
        and column.width in (None, found.type.list_size)
        if column.is_vector
        else found.type == declared
    )
    if not same:
        expected = str(declared).replace("[-1]", "")
        raise BadTable(f"column {column.name!r} is {found.type}, expected {expected}", where)
    if found.null_count and not column.nullable:
        raise BadTable(f"column {column.name!r} has {found.null_count} empty rows", where)
    if column.is_vector and pa.types.is_floating(column.type):
        values = found.combine_chunks().drop_null().flatten().to_numpy(zero_copy_only=False)
        if not np.isfinite(values).all():
            raise BadTable(f"column {column.name!r} holds NaN or infinite numbers", where)
