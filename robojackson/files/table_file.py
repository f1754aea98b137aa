"""Base class of dataclasses that are one Parquet table: schema, conversion to columns and back."""

import json
from os import PathLike
from pathlib import Path
from typing import ClassVar, Self

import numpy as np

from robojackson.files import tables
from robojackson.files.file_tree import results_in
from robojackson.files.foreign_file import read_file
from robojackson.files.json_types import to_json_types
from robojackson.files.table_door import NAMES
from robojackson.files.table_types import Facts as Facts
from robojackson.files.table_types import TableSchema

Columns = dict[str, np.ndarray]


class TableFile:
    """Base class of a dataclass that is one Parquet table."""

    SCHEMA: ClassVar[TableSchema]

    def to_columns(self) -> tuple[Columns, Facts]:
        """Return the columns by name and the metadata of the table."""
        raise NotImplementedError

    @classmethod
    def from_columns(cls, columns: Columns, facts: Facts) -> Self:
        """Return the value with these columns and this metadata."""
        raise NotImplementedError

    def to_bytes(self) -> bytes:
        """Return the content of the Parquet file."""
        return tables.encode(self)

    @classmethod
    def from_bytes(cls, data: bytes, where: str) -> Self:
        """Return the value that a Parquet file holds.

        Args:
            data: Content of the file.
            where: Name of the table in errors.

        Raises:
            BadTable: not Parquet, another table, or a column or metadata key that is wrong.
        """
        return tables.decode(cls, data, where)

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the Parquet file, whole or not at all.

        Returns:
            The path.

        Raises:
            StoreError: the file cannot be written.
        """
        file = Path(path)
        with results_in(file.parent) as files:
            files.write(file.name, self.to_bytes())
        return file

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Return the value that a Parquet file holds.

        Raises:
            StoreError: no such file.
            BadTable: not Parquet, another table, or a column or metadata key that is wrong.
        """
        file = Path(path)
        return cls.from_bytes(read_file(file, usual=NAMES.get(cls.SCHEMA.name, ())), str(file))


def numbered(index: str, rows: int, period_s: float) -> Columns:
    """Return the columns that number the rows: `index`, and `time_s` at equal spaces, seconds."""
    return {index: np.arange(rows, dtype=np.int32), "time_s": np.arange(rows) * period_s}


def json_facts(value: Facts) -> Facts:
    """Return metadata in JSON's types; what JSON has no type for as `to_json_types` writes it."""
    found: Facts = json.loads(json.dumps(value, default=to_json_types))
    return found
