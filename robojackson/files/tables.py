"""Convert dataclasses of the stages to Parquet and back; check each file against its schema.

Parquet with zstd; vectors are fixed-size lists; units and frames are in the fields' metadata, facts
about the whole table (fps, names) are JSON in the schema's metadata. A file that violates its
schema raises `BadTable`, which names the column and the file.
"""

import io
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar, Protocol, Self, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from robojackson.errors import BadTable
from robojackson.files.table_door import (
    check,
    facts_of,
    numbers_of,
    read_parquet,
    require_known,
)
from robojackson.files.table_types import VERSION, Column, TableSchema

Row = Mapping[str, Any]


class Tabular(Protocol):
    """Interface of a table (`table_file.TableFile` is the base class of the tables)."""

    SCHEMA: ClassVar[TableSchema]

    def to_columns(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Return the columns by name and the metadata of the table."""

    @classmethod
    def from_columns(cls, columns: dict[str, np.ndarray], facts: dict[str, Any]) -> Self:
        """Return the value with these columns and this metadata."""


Value = TypeVar("Value", bound=Tabular)


def encode(value: Tabular) -> bytes:
    """Return a stage's dataclass as a Parquet file."""
    schema = value.SCHEMA
    columns, metadata = value.to_columns()
    arrays = [_vector_column(c, columns[c.name]) for c in schema.columns]
    fields = [
        column.field(array.type.list_size if column.is_vector else None)
        for column, array in zip(schema.columns, arrays, strict=True)
    ]
    return _to_bytes(schema, arrays, fields, metadata)


def decode(cls: type[Value], data: bytes, where: str) -> Value:
    """Return the dataclass that a Parquet file holds.

    Raises:
        BadTable: not Parquet, another table, or a column or metadata key that is wrong.
    """
    schema = cls.SCHEMA
    table = check(schema, read_parquet(data, where), where)
    if not table.num_rows:
        raise BadTable(f"the {schema.name} has no rows", where)
    columns = {c.name: numbers_of(c, table, where) for c in schema.columns}
    try:
        _require_order(schema, columns)
        return cls.from_columns(columns, facts_of(schema, table, where))
    except (KeyError, ValueError, TypeError) as cause:
        raise BadTable(f"the {schema.name} is inconsistent: {cause}", where) from cause


def _require_order(schema: TableSchema, columns: Mapping[str, np.ndarray]) -> None:
    """Raise `ValueError` where frames or steps are not counted from 0, or their times go back."""
    if "time_s" not in columns:
        return
    number, times = columns[schema.row], columns["time_s"]
    if (number != np.arange(len(number))).any():
        raise ValueError(f"{schema.row} does not count the rows from 0")
    if (np.diff(times) < 0.0).any() or (len(times) > 1 and times[0] == times[-1]):
        raise ValueError("time_s does not go on")


def encode_rows(schema: TableSchema, rows: Iterable[Row]) -> bytes:
    """Return records, one mapping a row, as a Parquet file.

    Raises:
        BadTable: a row lacks a required column, or has one that the table does not know.
    """
    listed = list(rows)
    names = dict.fromkeys(c.name for c in schema.columns)
    names.update(dict.fromkeys(name for row in listed for name in row))
    columns = [require_known(schema, name) for name in names]
    arrays = [_scalar_column(schema, column, listed) for column in columns]
    return _to_bytes(schema, arrays, [c.field() for c in columns], {})


def decode_rows(schema: TableSchema, data: bytes, where: str) -> list[dict[str, Any]]:
    """Return the records of a Parquet file; nullable columns that it lacks are empty.

    Raises:
        BadTable: not Parquet, another table, or a column that is wrong.
    """
    result: list[dict[str, Any]] = decode_table(schema, data, where).to_pylist()
    return result


def decode_table(schema: TableSchema, data: bytes, where: str) -> pa.Table:
    """Return the records of a Parquet file as an Arrow table; nullable columns that it lacks, since
    an earlier version wrote it, are empty.

    Raises:
        BadTable: not Parquet, another table, or a column that is wrong.
    """
    found = read_parquet(data, where)
    for field in (c.field() for c in schema.columns if c.nullable):
        if field.name not in found.column_names:
            found = found.append_column(field, pa.nulls(found.num_rows, field.type))
    known = [c.name for c in schema.columns]
    if all(found.column_names.count(name) == 1 for name in known):
        found = found.select([*known, *(n for n in found.column_names if n not in known)])
    return check(schema, found, where)


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
    """Return a Python scalar, None where it is NaN; infinity and times are unchanged."""
    scalar = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(scalar, float) and np.isnan(scalar) else scalar


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


def require_distinct(names: Sequence[str]) -> None:
    """Raise `BadTable` for two columns of one name: rows by name would lose one."""
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise BadTable(f"two columns are called {', '.join(twice)}: name them with AS")
