"""Values of the program in JSON's types: null, booleans, numbers, text, arrays and objects."""

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


def to_json_types(value: Any) -> Any:
    """Return a value in JSON's types, so that `json.dumps(..., allow_nan=False)` accepts it.

    A dataclass and a mapping become a `dict` with text as keys; an array of any shape, a list and
    a tuple a `list`; a scalar of NumPy the number that it holds; NaN and infinity None. Anything
    else, such as a path or a time, becomes its text.
    """
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: to_json_types(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): to_json_types(inner) for key, inner in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return to_json_types(value.tolist())
    if isinstance(value, list | tuple):
        return [to_json_types(inner) for inner in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, str | int | bool) else str(value)


def number_of(value: float | None) -> float:
    """Return a figure of a JSON file as a number: NaN where the file has null (`to_json_types`)."""
    return math.nan if value is None else float(value)


def to_json(value: object) -> bytes:
    """Return a value as the content of a JSON file."""
    return json.dumps(to_json_types(value), indent=1, allow_nan=False).encode()
