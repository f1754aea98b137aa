"""A stage of the pipeline: a function whose calls are recorded in the store.

A call runs as a cached Prefect task (`tasks/runtime/engine.py`). Inside `records_only` it is read
from its record instead, and Prefect is never imported.

The key of a call: the stage's name and the text of its file, its parsed configuration, the sha256
of the inputs' content, the digest of the modules that it reaches and of those that lay out the
tables, the sha256 of the models it loads, and the versions of mujoco and mediapipe. Paths are never
in it. A record whose file is gone or altered counts as none (`tests/tasks/runtime/test_stage.py`).
"""

import hashlib
import inspect
import json
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, fields, is_dataclass
from functools import cache, cached_property, update_wrapper
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, ParamSpec, TypeVar, cast

from robojackson.errors import StoreError
from robojackson.robot.description import RobotDescription
from storage import stage_records
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.code_digest import digest, file_digest, imports_of, layout

if TYPE_CHECKING:
    from prefect import Task
    from prefect.futures import PrefectFuture

P = ParamSpec("P")
R = TypeVar("R")
Models = Callable[[Mapping[str, Any]], list[str]]
VERSIONED = ("mujoco", "mediapipe")
_records_only: ContextVar[bool] = ContextVar("records_only", default=False)
_label: ContextVar[str] = ContextVar("label", default="")


class NotRecorded(Exception):
    """A call has no record that can be read, and nothing may run."""


@contextmanager
def records_only() -> Iterator[None]:
    """Answer every call inside from its record; one that has none raises `NotRecorded`."""
    token = _records_only.set(True)
    try:
        yield
    finally:
        _records_only.reset(token)


def is_records_only() -> bool:
    """Return whether calls are answered from records alone (`records_only`)."""
    return _records_only.get()


@contextmanager
def labelled(name: str) -> Iterator[None]:
    """Name the task runs inside after a dance, a clip or a cell: `train_policy-<name>`."""
    token = _label.set(name)
    try:
        yield
    finally:
        _label.reset(token)


@dataclass(frozen=True)
class KeyRecipe:
    """Ingredients of the cache keys of a stage.

    Attributes:
        name: Name of the stage.
        text: Digest of the bare syntax tree of its file, its helpers included.
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
        """Return the cache key of a call; a path below the folder of records."""
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


class Stage(Generic[P, R]):
    """A function whose calls are recorded.

    Attributes:
        fn: The function itself.
        recipe: Recipe of its cache keys.
    """

    def __init__(self, fn: Callable[P, R], recipe: KeyRecipe) -> None:
        self.fn, self.recipe = fn, recipe
        self._signature = inspect.signature(fn)
        update_wrapper(self, fn)

    @property
    def name(self) -> str:
        """Name of the function, the task and the folder of its records."""
        return self.recipe.name

    @cached_property
    def task(self) -> "Task[P, R]":
        """The stage as a cached Prefect task."""
        from tasks.runtime.engine import cached_task

        return cached_task(self.fn, self.name, self.run_name, self.recipe.key)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Run as a task, which reads the record where there is one.

        Raises:
            NotRecorded: there is no record, inside `records_only`.
        """
        if not _records_only.get():
            return self.task(*args, **kwargs)
        found: R = self.required(*args, **kwargs)
        if inspect.iscoroutinefunction(self.fn):
            return cast("R", _awaitable(found))
        return found

    def submit(self, *args: P.args, **kwargs: P.kwargs) -> "PrefectFuture[R]":
        """Start a call in the background of the running flow."""
        return self.task.submit(*args, **kwargs)

    def outcomes(self, calls: Iterable[tuple[Any, ...]]) -> list[Any]:
        """Return the result of each call, or the exception that it raised; side by side in a flow.

        Args:
            calls: Positional arguments of each.
        """
        if _records_only.get():
            return [self.required(*call) for call in calls]
        futures: list[Any] = [self.task.submit(*call, return_state=False) for call in calls]
        return [future.result(raise_on_failure=False) for future in futures]

    def recorded(self, *args: Any, **kwargs: Any) -> Any | None:
        """Return the recorded result of a call, or None where it would have to run.

        Args:
            args, kwargs: Arguments of the call; those without effect on the result may be omitted.
        """
        try:
            return self.required(*args, **kwargs)
        except NotRecorded:
            return None

    def required(self, *args: Any, **kwargs: Any) -> Any:
        """Return the recorded result of a call.

        Raises:
            NotRecorded: there is no record, or a file of it is gone or altered.
        """
        given = self._signature.bind_partial(*args, **kwargs)
        given.apply_defaults()
        key = self.recipe.key(given.arguments)
        try:
            return stage_records.read(Store.from_environment(), key)
        except StoreError as cause:
            raise NotRecorded(key) from cause

    def run_name(self) -> str:
        """Name a task run after `labelled`; without it random digits distinguish runs."""
        return f"{self.name}-{_label.get() or uuid.uuid4().hex[:3]}"


async def _awaitable(value: Any) -> Any:
    return value


def stage(
    *,
    reaches: tuple[str, ...] = (),
    models: Models = lambda parameters: [],
    unkeyed: tuple[str, ...] = (),
) -> Callable[[Callable[P, R]], Stage[P, R]]:
    """Make a function a stage.

    Args:
        reaches: Modules that it uses without importing them, as in another process.
        models: Parameters of a call to the sha256 of the models that it loads.
        unkeyed: Parameters that do not change the result.
    """

    def decorate(function: Callable[P, R]) -> Stage[P, R]:
        return Stage(function, _recipe_of(function, reaches, models, unkeyed))

    return decorate


@cache
def versions() -> dict[str, str]:
    """Return the versions of the packages that are part of every key."""
    return {name: version(name) for name in VERSIONED}


def identity(value: Any) -> Any:
    """Return what a value is, in JSON: artifacts by content, configurations by class and fields.

    The order of a mapping counts in a robot alone, whose patterns and contacts have one; Prefect's
    database keeps none in the parameters of a run, so a configuration from there has another.

    Raises:
        TypeError: a value without a content, such as a path.
    """
    if isinstance(value, Artifact):
        return {"sha256": value.sha256}
    if is_dataclass(value) and not isinstance(value, type):
        inner = {f.name: getattr(value, f.name) for f in fields(value) if f.compare}
        if isinstance(value, RobotDescription):
            inner = {k: list(v.items()) if isinstance(v, Mapping) else v for k, v in inner.items()}
        return {"class": type(value).__qualname__, **identity(inner)}
    if isinstance(value, Mapping):
        return {str(key): identity(inner) for key, inner in sorted(value.items())}
    if isinstance(value, list | tuple):
        return [identity(inner) for inner in value]
    if value is None or isinstance(value, str | int | float | bool):
        return value
    raise TypeError(f"{type(value).__name__} has no content that a cache key could hold")


def _recipe_of(
    function: Callable[..., Any], reaches: tuple[str, ...], models: Models, unkeyed: tuple[str, ...]
) -> KeyRecipe:
    file = Path(inspect.getfile(function))
    roots = (*imports_of(file), *reaches)
    return KeyRecipe(function.__name__, file_digest(file), roots, models, unkeyed)
