"""The decorator of every configuration: frozen, strict, no unknown keys, no NaN or infinity.

Strict means that no number, text or boolean is converted into another: `"3"` is no number, `3.0` no
integer and `1` no boolean. What YAML and JSON cannot express is converted to the field's type: a
list for a tuple, a mapping for a section, text for a path.
"""

from collections.abc import Iterator, Mapping
from dataclasses import field
from functools import reduce
from operator import or_
from types import UnionType
from typing import (
    Annotated,
    Any,
    TypeVar,
    Union,
    cast,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

import pydantic
from pydantic import ConfigDict, Strict
from pydantic.dataclasses import dataclass

Config = TypeVar("Config")
CHECKED = ConfigDict(extra="forbid", allow_inf_nan=False)
SCALARS = (bool, int, float)


@dataclass_transform(frozen_default=True, field_specifiers=(pydantic.Field, field))
def config_dataclass(cls: type[Config]) -> type[Config]:
    """Return a frozen dataclass whose values are checked when it is made.

    Args:
        cls: Fields with types, defaults and, by `pydantic.Field`, limits.

    Returns:
        The class. Making an instance raises `pydantic.ValidationError` for a wrong type, an unknown
        name, a value outside its limits, NaN and infinity.
    """
    hints = get_type_hints(cls, include_extras=True)
    cls.__annotations__ = {name: _strict(hints[name]) for name in cls.__annotations__}
    return cast("type[Config]", dataclass(frozen=True, config=CHECKED)(cls))


def _strict(kind: Any) -> Any:
    """Return a type whose numbers and booleans are not converted."""
    if kind in SCALARS:
        return Annotated[kind, Strict()]
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return Annotated[(_strict(inner[0]), *kind.__metadata__)]
    if origin in (Union, UnionType):
        return reduce(or_, map(_strict, inner))
    if origin in (tuple, dict, list):
        return origin[tuple(each if each is ... else _strict(each) for each in inner)]
    return kind


def leaves(values: Mapping[str, object], above: str = "") -> Iterator[tuple[str, object]]:
    """Yield the key paths of all values that are no sections, with the values."""
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value
