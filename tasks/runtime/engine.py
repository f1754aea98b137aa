"""A stage as a cached Prefect task: where Prefect keeps and finds its records.

Prefect keeps results where `PREFECT_LOCAL_STORAGE_PATH` or a block of its server says: elsewhere
for the command line than for workers. `Records` keeps them in the store, wherever that is.
"""

import asyncio
from collections.abc import Callable, Mapping
from typing import Any, ParamSpec, TypeVar

from prefect import Task, task
from prefect.cache_policies import CacheKeyFnPolicy
from prefect.context import TaskRunContext
from prefect.filesystems import RemoteFileSystem
from prefect.serializers import JSONSerializer

from storage import stage_records
from storage.store import Store

P = ParamSpec("P")
R = TypeVar("R")
BASE = "robojackson://records"
"""Base path of the records; the store of the environment decides where they are."""


class Records(RemoteFileSystem):
    """The store of the environment as a place for Prefect's records.

    Prefect stores a record at an address: the base path of the file system, then the key. Of a
    file system without a base path it refuses every key that is not in the working directory.
    """

    _block_type_name = "RoboJackson records"
    _block_type_slug = "robojackson-records"
    basepath: str = BASE

    def read_path(self, path: str, _sync: bool = True) -> bytes:  # type: ignore[override]
        """Return the content of a record, named by its key or its address."""
        return Store.from_environment().read(_store_key(path))

    def write_path(self, path: str, content: bytes, _sync: bool = True) -> str:  # type: ignore[override]
        """Write a record, whole or not at all; return its address."""
        Store.from_environment().put(_store_key(path), content)
        return path

    async def aread_path(self, path: str) -> bytes:
        """Return the content of a record without blocking the flow."""
        return await asyncio.to_thread(self.read_path, path)

    async def awrite_path(self, path: str, content: bytes) -> str:
        """Write a record without blocking the flow; return its address."""
        return await asyncio.to_thread(self.write_path, path, content)


def _store_key(path: str) -> str:
    return stage_records.address(path.removeprefix(f"{BASE}/"))


class ArtifactSerializer(JSONSerializer):
    """JSON whose artifacts are verified when read: Prefect takes an unreadable record for none."""

    type: str = "robojackson-artifact"

    def dumps(self, obj: Any) -> bytes:
        """Serialise what a stage returned."""
        return stage_records.encode(obj)

    def loads(self, blob: bytes) -> Any:
        """Parse it and verify that every artifact in it is in the store, unaltered."""
        return stage_records.decode(blob, Store.from_environment())


def cached_task(
    function: Callable[P, R],
    name: str,
    run_name: Callable[[], str],
    cache_key: Callable[[Mapping[str, Any]], str],
) -> Task[P, R]:
    """Make a function a Prefect task that is cached in the store.

    Args:
        function: Function that the task runs.
        name: Name of the task.
        run_name: Returns the name of a run, when it begins.
        cache_key: Returns the key of a call from its parameters.
    """

    def key(context: TaskRunContext, parameters: dict[str, Any]) -> str:
        return cache_key(parameters)

    made: Task[P, R] = task(
        name=name,
        task_run_name=run_name,
        cache_policy=CacheKeyFnPolicy(cache_key_fn=key),
        persist_result=True,
        result_serializer=ArtifactSerializer(),
    )(function)
    made.result_storage = Records()  # the decorator takes saved blocks only; this one has no state
    return made
