"""Types of tables: a column with type, unit and frame; a table with columns and metadata."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import pyarrow as pa
from pydantic import TypeAdapter

VERSION = 1
Facts = dict[str, Any]
"""Metadata of a table."""
FactTypes = Mapping[str, Any]
"""Types of such facts by key, as pydantic takes them."""
WORLD = "world"
F32, F64, I32, I64 = pa.float32(), pa.float64(), pa.int32(), pa.int64()
TEXT, FLAG, STATE = pa.string(), pa.bool_(), pa.int8()


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes:
        name: Name of the column.
        type: Type of one number (or text).
        unit: SI symbol, `1` for a ratio, `` for what has none.
        frame: Axes of a vector, `` for a scalar.
        width: Numbers a row; 1 is a scalar, None a vector whose width the file itself gives.
        nullable: Whether a row may be empty.
        least, most: Bounds of the numbers of a table that is a dataclass.
    """

    name: str
    type: pa.DataType
    unit: str = ""
    frame: str = ""
    width: int | None = 1
    nullable: bool = False
    least: float = -1e6
    most: float = 1e6

    @property
    def is_vector(self) -> bool:
        """Return whether a row holds more than one number."""
        return self.width != 1

    def field(self, width: int | None = None) -> pa.Field:
        """Return the column as an Arrow field, with unit and frame in its metadata."""
        size = self.width or width or -1
        type_ = pa.list_(self.type, size) if self.is_vector else self.type
        notes = {"unit": self.unit, "frame": self.frame}
        return pa.field(self.name, type_, self.nullable, {k: v for k, v in notes.items() if v})


@dataclass(frozen=True)
class TableSchema:
    """One table.

    Attributes:
        name: Name of the table.
        row: What one row is.
        columns: All fixed columns.
        metadata: Keys that the file's metadata must have and the types of their JSON values
            (`fact_types`).
        optional: Keys that the metadata may have.
        dynamic: Prefixes of further columns, float64, nullable, with their unit; which of them a
            file has depends on the reward and the robot.
    """

    name: str
    row: str
    columns: tuple[Column, ...]
    metadata: FactTypes = field(default_factory=dict)
    optional: FactTypes = field(default_factory=dict)
    dynamic: Mapping[str, str] | None = None

    @cached_property
    def facts(self) -> Mapping[str, TypeAdapter[object]]:
        """Return the validators of the metadata, by key."""
        return {key: TypeAdapter(kind) for key, kind in {**self.metadata, **self.optional}.items()}

    def column(self, name: str) -> Column | None:
        """Return the column of that name, also a dynamic one; None for an unknown name."""
        for column in self.columns:
            if column.name == name:
                return column
        for start, unit in (self.dynamic or {}).items():
            if name.startswith(start):
                return Column(name, F64, unit, nullable=True)
        return None
