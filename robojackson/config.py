"""The decorator of every configuration: frozen, strict, no unknown keys, no NaN or infinity.

Strict means that no value is converted: `"3"` is no number and `1` is no boolean. `validated` reads
plain values, as YAML and JSON have them: there a list is a tuple, a mapping a section and text a
path where the field asks for one.
"""

import json
from dataclasses import field
from typing import Any, TypeVar, cast, dataclass_transform

import pydantic
from pydantic import ConfigDict, TypeAdapter
from pydantic.dataclasses import dataclass

Config = TypeVar("Config")
STRICT = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


@dataclass_transform(frozen_default=True, field_specifiers=(pydantic.Field, field))
def config_dataclass(cls: type[Config]) -> type[Config]:
    """A frozen dataclass whose values are checked when it is made.

    Args:
        cls: Fields with types, defaults and, by `pydantic.Field`, limits.

    Returns:
        The class. Making an instance raises `pydantic.ValidationError` for a wrong type, an unknown
        name, a value outside its limits, NaN and infinity.
    """
    return cast("type[Config]", dataclass(frozen=True, config=STRICT)(cls))


def validated(cls: type[Config], values: Any) -> Config:
    """A configuration from plain values.

    Args:
        cls: A configuration, or any type that pydantic knows.
        values: As `yaml` or `json` return them; anything else goes by its text.

    Raises:
        pydantic.ValidationError: an unknown key, a wrong type or a value outside its limits.
    """
    return TypeAdapter(cls).validate_json(json.dumps(values, default=str))
