"""Laws of values in JSON's types."""

import json
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from robojackson.files.json_types import to_json_types


@dataclass(frozen=True)
class Inner:
    shares: tuple[float, ...]


@dataclass(frozen=True)
class Outer:
    name: str
    inner: Inner
    by_move: dict[str, Inner] = field(default_factory=dict)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (np.float32(0.5), 0.5),
        (np.int64(3), 3),
        (np.bool_(True), True),
        (np.arange(4.0).reshape(2, 2), [[0.0, 1.0], [2.0, 3.0]]),
        (np.array([1.0, np.nan]), [1.0, None]),
        (np.array(2.0), 2.0),
        ((1, (2.5, "a")), [1, [2.5, "a"]]),
        (MappingProxyType({1: float("inf")}), {"1": None}),
        (float("nan"), None),
        (Path("a/b"), "a/b"),
        (datetime(2026, 1, 2, tzinfo=UTC), "2026-01-02 00:00:00+00:00"),
        (Outer("x", Inner((1.0,))), {"name": "x", "inner": {"shares": [1.0]}, "by_move": {}}),
    ],
)
def test_a_value_has_one_form_in_json(value: Any, expected: Any) -> None:
    found = to_json_types(value)
    assert found == expected
    assert type(found) is type(expected)


def test_what_json_has_already_stays() -> None:
    value = {"a": [None, True, 1, 2.5, "text"], "b": {}}
    assert to_json_types(value) == value


def test_a_dataclass_is_written_as_its_fields_are() -> None:
    value = Outer("x", Inner((0.1, 2.0)), {"walk": Inner(())})
    assert json.dumps(to_json_types(value), allow_nan=False) == json.dumps(asdict(value))
