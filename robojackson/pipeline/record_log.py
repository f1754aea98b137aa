"""Tables that grow while a training runs: episodes and evaluations, rewritten whole each time."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from robojackson.files import tables
from robojackson.files.file_tree import FileTree
from robojackson.files.table_types import TableSchema


@dataclass
class RecordLog:
    """Rows of one table in one file, kept over a resume.

    Attributes:
        files: Tree of files that holds the log.
        key: Key of the file.
        schema: Schema of the table.
        common: Columns that all rows share (run_id, move, setup, seed).
        resumes: Whether the rows that are there are of this run; else they go when it has its own.
    """

    files: FileTree
    key: str
    schema: TableSchema
    common: Mapping[str, object]
    resumes: bool = True
    _rows: list[dict[str, Any]] = field(default_factory=list)
    _earlier: bool = True

    def __post_init__(self) -> None:
        if self.resumes and self.files.exists(self.key):
            data, where = self.files.read(self.key), self.files.address(self.key)
            self._rows = tables.decode_rows(self.schema, data, where)

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def rows(self) -> list[dict[str, Any]]:
        """A copy of all rows."""
        return list(self._rows)

    def append(self, rows: Iterable[Mapping[str, Any]]) -> None:
        """Add rows. What an interrupted run wrote after its last checkpoint is dropped first."""
        new = [{**self.common, **row} for row in rows]
        if self._earlier and new:
            self._drop_from(min(int(row.get("step") or 0) for row in new))
            self._earlier = False
        self._rows.extend(new)

    def save(self) -> None:
        """Write the whole table."""
        self.files.write(self.key, tables.encode_rows(self.schema, self._rows))

    def _drop_from(self, step: int) -> None:
        self._rows = [row for row in self._rows if (row["step"] or 0) < step]
