"""Read YAML as version 1.2: `yes`, `no`, `on` and `off` are words, and a repeated key
is an error.
"""

import re
from typing import Any, TypeVar

import yaml

Value = TypeVar("Value")
MOST_VALUES = 100_000
"""In one text, those of an alias counted wherever it stands."""
NAMELESS = 'in "<unicode string>", '
"""What PyYAML writes for the name of a text."""


class Yaml12(yaml.SafeLoader):
    """SafeLoader with the scalars of YAML 1.2, in which 010 is ten and nothing a date, and no
    doubled keys."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Refuse a repeated key; return the mapping."""
        seen: set[Any] = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if key in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"key {key!r} is listed twice", key_node.start_mark
                )
            seen.add(key)
        result: dict[Any, Any] = super().construct_mapping(node, deep)
        return result


BASES = {"0o": 8, "0x": 16}
REDEFINED = (":bool", ":float", ":int", ":timestamp")
Yaml12.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in rules if not tag.endswith(REDEFINED)]
    for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
Yaml12.add_implicit_resolver(
    "tag:yaml.org,2002:bool", re.compile(r"^(?:true|True|TRUE|false|False|FALSE)$"), list("tTfF")
)
Yaml12.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(?:(?:\d+\.\d*|\.\d+)(?:[eE][-+]?\d+)?|\d+[eE][-+]?\d+|\.inf|\.nan)$"),
    list("-+0123456789."),
)
Yaml12.add_implicit_resolver(
    "tag:yaml.org,2002:int",
    re.compile(r"^(?:[-+]?\d+|0o[0-7]+|0x[0-9a-fA-F]+)$"),
    list("-+0123456789"),
)


def _integer(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> int:
    text = str(loader.construct_scalar(node))
    return int(text, BASES.get(text[:2], 10))


Yaml12.add_constructor("tag:yaml.org,2002:int", _integer)


def require_few(value: Value) -> Value:
    """Return the value of a text, refused where its aliases make a few lines endless.

    Raises:
        ValueError: there are more than `MOST_VALUES`, or a value holds itself.
    """
    known: dict[int, int] = {}

    def count(part: object) -> int:
        if not isinstance(part, dict | list | set | tuple):
            return 1
        if id(part) not in known:
            known[id(part)] = MOST_VALUES + 1  # while it is counted: a value that holds itself
            inner = [*part, *part.values()] if isinstance(part, dict) else part
            known[id(part)] = 1 + sum(map(count, inner))
        return known[id(part)]

    if count(value) > MOST_VALUES:
        raise ValueError(f"more than {MOST_VALUES:,} values, or one that holds itself")
    return value


def mistake(cause: Exception) -> str:
    """Return in one line what is wrong with a text and where, by the error of reading it."""
    if not isinstance(cause, yaml.MarkedYAMLError) or cause.problem_mark is None:
        return " ".join(str(cause).replace(NAMELESS, "at ").split())
    reason = f"{_place(cause.problem_mark)}: {cause.problem}"
    if cause.context is None or cause.context_mark is None:
        return reason
    return f"{reason} ({cause.context} that begins at {_place(cause.context_mark)})"


def _place(mark: yaml.Mark) -> str:
    return f"line {mark.line + 1}, column {mark.column + 1}"
