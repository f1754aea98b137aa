"""Records of cached stages: what a call of a stage returned, under its cache key.

    records/<stage>/<sha256 of the call>.json

Their place depends on the store alone, so that the command line, workers and every machine that
reaches the store share them. Prefect writes and reads them (`tasks/runtime/engine.py`); the result
inside is JSON of ours, so that a cached pass is read without Prefect.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from robojackson.errors import StoreError
from storage.artifact import Artifact
from storage.store import Store

FOLDER = "records"
ARTIFACT = "artifact"
"""The only key of a JSON object that stands for an artifact."""


def address(key: str) -> str:
    """Return the key in the store of the record of a call."""
    return f"{FOLDER}/{key}"


def encode(value: Any) -> bytes:
    """Serialise what a stage returned: artifacts, in mappings and lists of any depth, or JSON.

    Raises:
        TypeError: the value holds something else.
    """
    return json.dumps(_with_tagged_artifacts(value)).encode()


def decode(data: bytes | str, store: Store) -> Any:
    """Parse what `encode` wrote and verify every artifact in it.

    Raises:
        StoreError: it is no such JSON, or a file of it is gone or altered.
    """
    try:
        return _artifacts(json.loads(data), store)
    except (ValueError, TypeError, RecursionError) as cause:
        raise StoreError(f"a record of the cache cannot be read: {cause}") from cause


def read(store: Store, key: str) -> Any:
    """Return the recorded result of a call.

    Args:
        key: Cache key of the call.
    Raises:
        StoreError: there is no record, it cannot be read, or a file of it is gone or altered.
    """
    try:
        result = json.loads(store.read(address(key)))["result"]
    except (ValueError, TypeError, KeyError, RecursionError) as cause:
        raise StoreError(f"{store.address(address(key))}: not a record: {cause}") from cause
    return decode(result, store)


def _with_tagged_artifacts(value: Any) -> Any:
    """Return a result for `json.dumps`: each artifact as an object whose only key is ARTIFACT."""
    if isinstance(value, Artifact):
        return {ARTIFACT: asdict(value)}
    if isinstance(value, Mapping):
        if set(value) == {ARTIFACT}:
            raise TypeError(f"a mapping whose only key is {ARTIFACT!r} would read as an artifact")
        return {str(key): _with_tagged_artifacts(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_with_tagged_artifacts(inner) for inner in value]
    return value


def _artifacts(value: Any, store: Store) -> Any:
    if isinstance(value, dict):
        if set(value) == {ARTIFACT}:
            return store.verify(Artifact(**value[ARTIFACT]))
        return {key: _artifacts(inner, store) for key, inner in value.items()}
    if isinstance(value, list):
        return [_artifacts(inner, store) for inner in value]
    return value
