"""Dataclasses of the stages to Parquet and back, each file checked against its schema.

Parquet with zstd; vectors are fixed-size lists; units and frames stand in the fields' metadata,
facts about the whole table (fps, names) as JSON in the schema's. A file that violates its schema is
a `BadTable` that names the column and the file.
"""

import io
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar, Protocol, Self, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from robojackson.errors import BadTable
from robojackson.files.table_types import VERSION, Column, TableSchema

MAKERS = {"SmplSequence": "mocap", "ReferenceMotion": "retarget"}
"""Which command writes a table that other commands read."""
Row = Mapping[str, Any]


class Tabular(Protocol):
    """What can be a table (`table_file.TableFile` is the base class of those that are)."""

    SCHEMA: ClassVar[TableSchema]

    def to_columns(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]: ...

    @classmethod
    def from_columns(cls, columns: dict[str, np.ndarray], facts: dict[str, Any]) -> Self: ...


Value = TypeVar("Value", bound=Tabular)


def encode(value: Tabular) -> bytes:
    """A stage's dataclass as a Parquet file."""
    schema = value.SCHEMA
    columns, metadata = value.to_columns()
    arrays = [_vector_column(c, columns[c.name]) for c in schema.columns]
    fields = [
        column.field(array.type.list_size if column.is_vector else None)
        for column, array in zip(schema.columns, arrays, strict=True)
    ]
    return _to_bytes(schema, arrays, fields, metadata)


def decode(cls: type[Value], data: bytes, where: str) -> Value:
    """The dataclass that a Parquet file holds.

    Raises:
        BadTable: not Parquet, another table, or a column or metadata key that is wrong.
    """
    schema = cls.SCHEMA
    table = check(schema, _from_bytes(data, where), where)
    columns = {c.name: _numbers(c, table.column(c.name)) for c in schema.columns}
    try:
        return cls.from_columns(columns, metadata_of(table))
    except (KeyError, ValueError, TypeError) as cause:
        raise BadTable(f"{where}: metadata of {schema.name} is wrong: {cause}") from cause


def encode_rows(schema: TableSchema, rows: Iterable[Row]) -> bytes:
    """Records, one mapping a row, as a Parquet file.

    Raises:
        BadTable: a row lacks a column that may not be empty, or has one the table does not know.
    """
    listed = list(rows)
    names = dict.fromkeys(c.name for c in schema.columns)
    names.update(dict.fromkeys(name for row in listed for name in row))
    columns = [_known(schema, name) for name in names]
    arrays = [_scalar_column(schema, column, listed) for column in columns]
    return _to_bytes(schema, arrays, [c.field() for c in columns], {})


def decode_rows(schema: TableSchema, data: bytes, where: str) -> list[dict[str, Any]]:
    """The records of a Parquet file.

    Raises:
        BadTable: not Parquet, another table, or a column that is wrong.
    """
    result: list[dict[str, Any]] = decode_table(schema, data, where).to_pylist()
    return result


def decode_table(
    schema: TableSchema, data: bytes, where: str, *, earlier: bool = False
) -> pa.Table:
    """The records of a Parquet file, as an Arrow table.

    Args:
        earlier: Whether it may be of an earlier version: nullable columns that it lacks are empty.
    Raises:
        BadTable: not Parquet, another table, or a column that is wrong.
    """
    found = _from_bytes(data, where)
    if earlier:
        for field in (c.field() for c in schema.columns if c.nullable):
            if field.name not in found.column_names:
                found = found.append_column(field, pa.nulls(found.num_rows, field.type))
        known = [c.name for c in schema.columns if c.name in found.column_names]
        found = found.select([*known, *(n for n in found.column_names if n not in known)])
    return check(schema, found, where)


def check(schema: TableSchema, table: pa.Table, where: str) -> pa.Table:
    """The table itself, if it is what its schema says.

    Raises:
        BadTable: the message names the column (or metadata key), what is wrong and the file.
    """
    _require_same(schema, table, where)
    for column in schema.columns:
        if column.name not in table.column_names:
            raise BadTable(
                f"{where}: column {column.name!r} of {schema.name} is missing. "
                f"It has: {', '.join(table.column_names)}"
            )
    for name in table.column_names:
        _check_column(_known(schema, name, where), table, where)
    for key in schema.metadata:
        if key not in metadata_of(table):
            raise BadTable(f"{where}: metadata key {key!r} of {schema.name} is missing")
    return table


def metadata_of(table: pa.Table) -> dict[str, Any]:
    """The facts about the whole table; what is not JSON is not ours and left out."""
    facts: dict[str, Any] = {}
    for key, value in (table.schema.metadata or {}).items():
        try:
            facts[key.decode()] = json.loads(value)
        except ValueError:
            continue
    return facts


def _require_same(schema: TableSchema, table: pa.Table, where: str) -> None:
    found = metadata_of(table).get("table", schema.name)
    if found != schema.name:
        maker = MAKERS.get(schema.name)
        hint = f"; `robojackson {maker}` writes one" if maker else ""
        raise BadTable(f"{where}: holds a {found}, expected a {schema.name}{hint}")


def _check_column(column: Column, table: pa.Table, where: str) -> None:
    found = table.column(column.name)
    wanted = column.field().type
    same = (
        pa.types.is_fixed_size_list(found.type)
        and found.type.value_type == column.type
        and column.width in (None, found.type.list_size)
        if column.is_vector
        else found.type == wanted
    )
    if not same:
        expected = str(wanted).replace("[-1]", "")
        raise BadTable(f"{where}: column {column.name!r} is {found.type}, expected {expected}")
    if found.null_count and not column.nullable:
        raise BadTable(f"{where}: column {column.name!r} has {found.null_count} empty rows")
    if column.is_vector and pa.types.is_floating(column.type):
        _require_finite(column, found, where)


def _require_finite(column: Column, found: pa.ChunkedArray, where: str) -> None:
    values = found.combine_chunks().drop_null().flatten()
    if not np.isfinite(values.to_numpy(zero_copy_only=False)).all():
        raise BadTable(f"{where}: column {column.name!r} holds NaN or infinite numbers")


def _known(schema: TableSchema, name: str, where: str = "rows") -> Column:
    column = schema.column(name)
    if column is None:
        known = [c.name for c in schema.columns] + [f"{start}*" for start in schema.dynamic or {}]
        raise BadTable(
            f"{where}: column {name!r} is not one of {schema.name}. Known: {', '.join(known)}"
        )
    return column


def _vector_column(column: Column, values: np.ndarray) -> pa.Array:
    if not column.is_vector:
        return pa.array(values, column.type)
    flat = np.asarray(values).reshape(len(values), -1)
    mask = np.isnan(flat).any(1) if column.nullable else None
    items = pa.array(np.ascontiguousarray(flat).ravel(), column.type)
    return pa.FixedSizeListArray.from_arrays(
        items, flat.shape[1], mask=None if mask is None else pa.array(mask)
    )


def _scalar_column(schema: TableSchema, column: Column, rows: Sequence[Row]) -> pa.Array:
    values = [_without_nan(row.get(column.name)) for row in rows]
    missing = sum(value is None for value in values)
    if missing and not column.nullable:
        raise BadTable(f"{schema.name}: column {column.name!r} is empty in {missing} rows")
    try:
        return pa.array(values, column.type)
    except (pa.ArrowInvalid, pa.ArrowTypeError) as cause:
        raise BadTable(f"{schema.name}: column {column.name!r}: {cause}") from cause


def _without_nan(value: Any) -> Any:
    """Return a Python scalar, None where it is NaN; infinity and times stay what they are."""
    scalar = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(scalar, float) and np.isnan(scalar) else scalar


def _numbers(column: Column, found: pa.ChunkedArray) -> np.ndarray:
    """A column as an array, NaN rows where it is null."""
    array = found.combine_chunks()
    if not column.is_vector:
        result_: np.ndarray = array.to_numpy(zero_copy_only=False)
        return result_
    width = array.type.list_size
    rows = array.fill_null([np.nan] * width) if array.null_count else array
    result: np.ndarray = rows.flatten().to_numpy(zero_copy_only=False).reshape(len(array), width)
    return result


def _to_bytes(
    schema: TableSchema,
    arrays: Sequence[pa.Array],
    fields: Sequence[pa.Field],
    metadata: Mapping[str, object],
) -> bytes:
    facts = {"table": schema.name, "version": VERSION, "row": schema.row, **metadata}
    coded = {key: json.dumps(value, sort_keys=True) for key, value in facts.items()}
    sink = io.BytesIO()
    table = pa.Table.from_arrays(list(arrays), schema=pa.schema(list(fields), coded))
    pq.write_table(table, sink, compression="zstd")
    return sink.getvalue()


def _from_bytes(data: bytes, where: str) -> pa.Table:
    try:
        return pq.read_table(io.BytesIO(data), use_threads=False)  # small; a thread may outlive us
    except (pa.ArrowInvalid, OSError) as cause:
        reason = " ".join(str(cause).split())[:120]
        raise BadTable(f"{where}: not a Parquet file ({reason})") from cause


def require_distinct(names: Sequence[str]) -> None:
    """Raise `BadTable` for an answer with two columns of one name: rows by name would lose one."""
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise BadTable(f"two columns are called {', '.join(twice)}: name them with AS")
