"""Tables of `robojackson.files.tables` as artifacts of a store."""

from typing import Any, TypeVar

from robojackson.files import tables
from robojackson.files.table_types import TableSchema
from storage.artifact import Artifact
from storage.store import Store

Value = TypeVar("Value", bound=tables.Tabular)


def save(store: Store, stage: str, name: str, value: tables.Tabular) -> Artifact:
    """Store a dataclass under a key made of its content."""
    return store.save(stage, name, tables.encode(value))


def read(cls: type[Value], store: Store, artifact: Artifact) -> Value:
    """Return the dataclass that an artifact holds."""
    return tables.decode(cls, store.read(artifact.key), store.address(artifact.key))


def read_rows(schema: TableSchema, store: Store, artifact: Artifact) -> list[dict[str, Any]]:
    """Return the records that an artifact holds."""
    return tables.decode_rows(schema, store.read(artifact.key), store.address(artifact.key))
