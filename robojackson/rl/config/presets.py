"""Named presets of a configuration: numbers that belong together, as data.

A preset's numbers are defaults: whatever is written beside its name counts. Since a configuration
that was built holds every number, `dataclasses.replace` does not change over to another preset.
"""

from collections.abc import Mapping
from typing import Any

from pydantic_core import ArgsKwargs

Presets = Mapping[str, Mapping[str, Any]]


def with_preset(given: Any, presets: Presets, usual: str) -> Any:
    """What a frozen pydantic dataclass gets, with the numbers of its preset where it says nothing.

    An unknown preset passes, for the type of the field to refuse it.
    """
    if isinstance(given, ArgsKwargs):
        said = dict(given.kwargs or {})
        return ArgsKwargs(given.args, _filled(said, presets, usual))
    return _filled(dict(given), presets, usual) if isinstance(given, Mapping) else given


def _filled(said: dict[str, Any], presets: Presets, usual: str) -> dict[str, Any]:
    return {**presets.get(str(said.get("preset", usual)), {}), **said}
