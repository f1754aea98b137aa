"""Tables of `robojackson.pipeline.tables` as artifacts of a store."""

from typing import Any, TypeVar

from robojackson.pipeline import tables
from robojackson.pipeline.table_schemas import TableSchema
from storage.artifact import Artifact
from storage.store import Store

Value = TypeVar("Value")


def save(store: Store, stage: str, name: str, value: object) -> Artifact:
    """Keep a dataclass in the store under a key made of its content."""
    return store.save(stage, name, tables.encode(value))


def read(cls: type[Value], store: Store, artifact: Artifact) -> Value:
    """The dataclass that an artifact holds."""
    return tables.decode(cls, store.read(artifact.key), store.address(artifact.key))


def read_rows(schema: TableSchema, store: Store, artifact: Artifact) -> list[dict[str, Any]]:
    """The records that an artifact holds."""
    return tables.decode_rows(schema, store.read(artifact.key), store.address(artifact.key))
