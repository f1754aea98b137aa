"""No setting takes NaN or infinity, whichever dataclass it stands in."""

import math
from collections.abc import Iterator
from dataclasses import fields
from importlib import import_module
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest
from pydantic import TypeAdapter, ValidationError
from pydantic.dataclasses import is_pydantic_dataclass

ROOT = Path(__file__).parents[2]
DECORATOR = "@config_dataclass"
CLASSES, FIELDS = 50, 200
"""Least number of settings that are found."""


def configurations() -> list[type]:
    """Return every dataclass that the decorator of configurations made, in order of its module."""
    found: dict[str, type] = {}
    for folder in ("robojackson", "configs", "flows", "tasks"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            if DECORATOR not in path.read_text(encoding="utf-8"):
                continue
            module = import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
            own = [each for each in vars(module).values() if isinstance(each, type)]
            for each in own:
                if each.__module__ == module.__name__ and is_pydantic_dataclass(each):
                    found[f"{module.__name__}.{each.__qualname__}"] = each
    return list(found.values())


def with_number(kind: Any, number: float) -> Iterator[object]:
    """Yield values of a type that hold the number: itself, or in a list or a mapping."""
    if kind is float:
        yield number
        return
    inner = get_args(kind)
    name = str(kind)
    for each in inner:
        for value in with_number(each, number):
            if name.startswith(("tuple", "list", "collections.abc.Sequence")):
                yield [value] * (1 if ... in inner or name.startswith("list") else len(inner))
            elif name.startswith(("dict", "collections.abc.Mapping")):
                yield {"x": value}
            else:
                yield value


def numbers() -> Iterator[tuple[type, str, Any]]:
    for cls in configurations():
        hints = get_type_hints(cls)
        for field in fields(cls):
            if any(True for _ in with_number(hints[field.name], 1.0)):
                yield cls, field.name, hints[field.name]


NUMBERS = list(numbers())


def test_the_sweep_finds_the_settings() -> None:
    assert len(configurations()) > CLASSES
    assert len(NUMBERS) > FIELDS


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf], ids=str)
def test_no_setting_is_nan_or_infinite(number: float) -> None:
    """The key of the error is that of the number, so that nothing else was refused instead."""
    taken = []
    for cls, name, kind in NUMBERS:
        for value in with_number(kind, number):
            try:
                TypeAdapter(cls).validate_python({name: value})
            except ValidationError as refused:
                if not any(error["loc"][:1] == (name,) for error in refused.errors()):
                    taken.append(f"{cls.__qualname__}.{name} is not checked: {refused}")
            else:
                taken.append(f"{cls.__qualname__}.{name} takes {value}")
    assert taken == []
