"""Tables that grow while a training runs: episodes and evaluations, rewritten whole each time."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from robojackson.pipeline import tables
from robojackson.pipeline.table_schemas import TableSchema
from storage.artifact import Artifact
from storage.store import Store


@dataclass
class RecordLog:
    """Rows of one table in one file, kept over a resume.

    Attributes:
        store: Where the file is.
        key: Of the file.
        schema: Of the table.
        common: Columns that all rows share (run_id, move, setup, seed).
        goes_on: Whether the rows that are there are of this run; else they go when it has its own.
    """

    store: Store
    key: str
    schema: TableSchema
    common: Mapping[str, Any]
    goes_on: bool = True
    _rows: list[dict[str, Any]] = field(default_factory=list)
    _earlier: bool = True

    def __post_init__(self) -> None:
        if self.goes_on and self.store.exists(self.key):
            data, where = self.store.read(self.key), self.store.address(self.key)
            self._rows = tables.decode_rows(self.schema, data, where)

    def __len__(self) -> int:
        return len(self._rows)

    def append(self, rows: Iterable[Mapping[str, Any]]) -> None:
        """Add rows. What an interrupted run wrote after its last checkpoint is dropped first."""
        new = [{**self.common, **row} for row in rows]
        if self._earlier and new:
            self._drop_from(min(int(row.get("step") or 0) for row in new))
            self._earlier = False
        self._rows.extend(new)

    def save(self) -> Artifact:
        """Write the whole table."""
        return self.store.put(self.key, tables.encode_rows(self.schema, self._rows))

    def _drop_from(self, step: int) -> None:
        self._rows = [row for row in self._rows if (row["step"] or 0) < step]
