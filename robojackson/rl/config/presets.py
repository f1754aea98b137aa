"""Named presets of a configuration: sets of numbers, as data.

A preset's numbers are defaults: values beside its name override them. Since a built configuration
holds every number, `dataclasses.replace` does not switch to another preset.
"""

from collections.abc import Mapping
from typing import Any

from pydantic_core import ArgsKwargs

Presets = Mapping[str, Mapping[str, Any]]


def with_preset(given: Any, presets: Presets, usual: str) -> Any:
    """Return the arguments of a frozen pydantic dataclass, with the preset's numbers as defaults.

    An unknown preset passes; the type of the field refuses it.
    """
    if isinstance(given, ArgsKwargs):
        named = dict(given.kwargs or {})
        return ArgsKwargs(given.args, _filled(named, presets, usual))
    return _filled(dict(given), presets, usual) if isinstance(given, Mapping) else given


def _filled(named: dict[str, Any], presets: Presets, usual: str) -> dict[str, Any]:
    return {**presets.get(str(named.get("preset", usual)), {}), **named}
