"""What makes a stage a cached Prefect task, and what its cache key is made of.

The key: the task's name and text, its parsed configuration, the sha256 of the inputs' content, the
digest of the modules that it reaches and of those that lay out the tables, the sha256 of the models
it loads, and the versions of mujoco and mediapipe. Paths are never in it. A record whose file is
gone or altered cannot be read, which Prefect takes for a miss (`tests/tasks/test_caching.py` holds
it to that).
"""

import hashlib
import inspect
import json
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from prefect import Task, task
from prefect.cache_policies import CacheKeyFnPolicy
from prefect.context import TaskRunContext
from prefect.serializers import JSONSerializer

from storage.artifact import Artifact
from storage.store import Store
from tasks.digest import bare_tree, digest, imports_of

P = ParamSpec("P")
R = TypeVar("R")
Models = Callable[[Mapping[str, Any]], list[str]]
LAYOUT = ("storage.codecs", "storage.schemas")
"""Modules that say how results stand in files."""
VERSIONED = ("mujoco", "mediapipe")


@dataclass(frozen=True)
class Stage:
    """What a task's key needs to know of it.

    Attributes:
        name: Of the task.
        text: Bare syntax tree of its function.
        roots: Modules that it imports.
        models: Its parameters to the digests of the models that it loads.
        unkeyed: Parameters that do not change the result.
    """

    name: str
    text: str
    roots: tuple[str, ...]
    models: Models
    unkeyed: tuple[str, ...]

    def key(self, parameters: Mapping[str, Any]) -> str:
        """The cache key of a call; a path below the folder of records."""
        keyed = {k: v for k, v in parameters.items() if k not in self.unkeyed}
        facts = {
            "task": [self.name, self.text],
            "parameters": identity(keyed),
            "modules": digest(self.roots),
            "models": self.models(parameters),
            "layout": layout(),
            "versions": versions(),
        }
        text = json.dumps(facts, sort_keys=True)
        return f"{self.name}/{hashlib.sha256(text.encode()).hexdigest()}.json"


class ArtifactSerializer(JSONSerializer):
    """JSON whose artifacts are verified as they are read: an altered file makes no record."""

    type: str = "robojackson-artifact"

    def loads(self, blob: bytes) -> Any:
        """The value, if every artifact in it is in the store unaltered."""
        value = super().loads(blob)
        _verify(value, Store.from_environment())
        return value


def stage(
    *,
    reaches: tuple[str, ...] = (),
    models: Models = lambda parameters: [],
    unkeyed: tuple[str, ...] = (),
) -> Callable[[Callable[P, R]], Task[P, R]]:
    """Make a function a cached task.

    Args:
        reaches: Modules that it uses without importing them, as in another process.
        models: Parameters of a call to the sha256 of the models that it loads.
        unkeyed: Parameters that do not change the result.
    """

    def decorate(function: Callable[P, R]) -> Task[P, R]:
        facts = _stage_of(function, reaches, models, unkeyed)

        def key(context: TaskRunContext, parameters: dict[str, Any]) -> str:
            return facts.key(parameters)

        cached = task(
            name=facts.name,
            cache_policy=CacheKeyFnPolicy(cache_key_fn=key),
            persist_result=True,
            result_serializer=ArtifactSerializer(),
        )
        return cached(function)

    return decorate


@cache
def versions() -> dict[str, str]:
    """Of the packages whose version is part of every key."""
    return {name: version(name) for name in VERSIONED}


@cache
def layout() -> str:
    """Digest of how results stand in files: a table of an older layout could not be read."""
    files = [Path(str(import_module(name).__file__)) for name in LAYOUT]
    return hashlib.sha256("".join(bare_tree(f.read_text()) for f in files).encode()).hexdigest()


def identity(value: Any) -> Any:
    """What a value is, in JSON: artifacts by content, configurations by class and fields.

    Raises:
        TypeError: a value whose content cannot be told, such as a path.
    """
    if isinstance(value, Artifact):
        return {"sha256": value.sha256}
    if is_dataclass(value) and not isinstance(value, type):
        inner = {f.name: identity(getattr(value, f.name)) for f in fields(value) if f.compare}
        return {"class": type(value).__qualname__, **inner}
    if isinstance(value, Mapping):
        return {str(key): identity(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [identity(inner) for inner in value]
    if value is None or isinstance(value, str | int | float | bool):
        return value
    raise TypeError(f"{type(value).__name__} has no content that a cache key could hold")


def _stage_of(
    function: Callable[..., Any], reaches: tuple[str, ...], models: Models, unkeyed: tuple[str, ...]
) -> Stage:
    text = bare_tree(textwrap.dedent(inspect.getsource(function)))
    roots = (*imports_of(Path(inspect.getfile(function))), *reaches)
    return Stage(function.__name__, text, roots, models, unkeyed)


def _verify(value: Any, store: Store) -> None:
    if isinstance(value, Artifact):
        value.verify(store)
    elif isinstance(value, Mapping):
        for inner in value.values():
            _verify(inner, store)
    elif isinstance(value, list | tuple):
        for inner in value:
            _verify(inner, store)
