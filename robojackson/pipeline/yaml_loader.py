"""YAML to frozen dataclasses: unknown keys are refused with the file and the path of the key.

A file with `extends: robots/g1` begins with the keys of that one; a key of its own replaces the
whole of the other's. YAML is read as version 1.2 does it (`yaml_scalars`).
"""

import difflib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, get_args, get_type_hints

import yaml
from pydantic import TypeAdapter, ValidationError

from robojackson.errors import BadConfiguration, ConflictingValues, UnknownName
from robojackson.files.foreign_file import read_text
from robojackson.pipeline.configuration_files import (
    SUFFIXES,
    TOP_KINDS,
    display_name,
    find,
    names,
)
from robojackson.pipeline.yaml_scalars import Yaml12, mistake, require_few

Config = TypeVar("Config")
EXTENDS = "extends"
UNEXPECTED = ("unexpected_keyword_argument", "extra_forbidden")
"""Kinds of Pydantic's errors about a key that there is not."""
LARGEST = 2**20
"""Bytes of a file."""


def load(
    cls: type[Config],
    name_or_path: str | Path | None,
    overrides: Mapping[str, object] | None = None,
) -> Config:
    """Return a configuration, with defaults for what the file does not set.

    Args:
        cls: A frozen pydantic dataclass.
        name_or_path: `base`, `robots/humanoid`, or the path of a YAML file; None is no file.
        overrides: Values by key path (`{"train.seed": 3}`); text is read as YAML. A whole section
            applies before the keys within it, whatever their order.
    Raises:
        UnknownName: no such file.
        BadConfiguration: an unknown key, a wrong value, or no YAML.
    """
    path = None if name_or_path is None else _found(cls, name_or_path)
    values, places = _read_extended(path) if path else ({}, {})
    given = parsed_overrides(overrides or {})
    for key_path in sorted(given, key=lambda path: path.count(".")):
        _set(values, key_path.split("."), given[key_path])
    where = display_name(path) if path else "--set"
    try:
        return TypeAdapter(cls).validate_python(values)
    except ValidationError as cause:
        where = places.get((*_keys(cause), "")[0], where)
        key = ".".join([*_keys(cause), ""])
        blamed = [g for g in given if key.startswith(f"{g}.") or f"{g}.".startswith(key)]
        if blamed:  # of several values that do not go together, those in question
            in_question = tuple(f"{key}{each}" for each in _conflict(cause))
            named = [g for g in blamed if g.startswith(in_question)]
            where = f"--set {', '.join(named or blamed)}"
        raise refusal(cls, cause, where) from cause


def own_values(name_or_path: str | Path) -> dict[str, object]:
    """Return the values of a file alone, without those of a file that it extends; raise as
    `load`."""
    return _read(find(name_or_path))


def _found(cls: type[Config], name_or_path: str | Path) -> Path:
    """Return the file of a configuration; an unknown name's error lists those of its class."""
    try:
        return find(name_or_path)
    except UnknownName as unknown:
        if unknown.kind not in TOP_KINDS:
            raise
        fitting = [name for name in names() if _fits(cls, name)]
        raise UnknownName(unknown.kind, unknown.name, unknown.where, fitting) from None


def _fits(cls: type[Config], name: str) -> bool:
    try:
        load(cls, name)
    except BadConfiguration:
        return False
    return True


def parsed_overrides(overrides: Mapping[str, object]) -> dict[str, object]:
    """Return overrides whose text is read as YAML.

    Raises:
        BadConfiguration: a text is no YAML.
    """
    return {key: _parsed(value, f"--set {key}") for key, value in overrides.items()}


def build(cls: type[Config], values: Mapping[str, object], where: str) -> Config:
    """Return a configuration from a mapping.

    Raises:
        BadConfiguration: an unknown key or a wrong value; the message has `where` and the key.
    """
    try:
        return TypeAdapter(cls).validate_python(dict(values))
    except ValidationError as cause:
        raise refusal(cls, cause, where) from cause


def _read_extended(
    path: Path, below: tuple[Path, ...] = ()
) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the values of a file over those of the one that it extends, and the file of each
    key."""
    values, place = _read(path), display_name(path)
    base, places = values.pop(EXTENDS, None), dict.fromkeys(values, place)
    if base is None:
        return values, places
    below = (*below, path.resolve())
    try:
        file = find(path.parent / base if Path(base).suffix in SUFFIXES else base)
    except (TypeError, UnknownName) as cause:
        raise BadConfiguration(f"{place}: {EXTENDS} is {base!r}: {cause}") from cause
    if file.resolve() in below:
        raise BadConfiguration(f"{place}: {EXTENDS} is {base!r}, which extends this file")
    other, origins = _read_extended(file, below)
    return other | values, origins | places


def _read(path: Path) -> dict[str, Any]:
    try:
        text = read_text(path, BadConfiguration, LARGEST)
    except BadConfiguration as cause:
        raise BadConfiguration(cause.reason, display_name(path)) from cause
    values = _parsed(text, display_name(path))
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise BadConfiguration(
            f"{display_name(path)}: holds {type(values).__name__}, expected keys and values"
        )
    return values


def _parsed(value: object, where: str) -> Any:
    if not isinstance(value, str):
        return value
    try:
        return require_few(yaml.load(value, Loader=Yaml12))
    except (yaml.YAMLError, ValueError, TypeError, RecursionError) as cause:
        raise BadConfiguration(f"{where}: {mistake(cause)}") from cause


def _set(values: dict[str, Any], keys: list[str], value: object) -> None:
    for key in keys[:-1]:
        inner = values.get(key)
        values[key] = dict(inner) if isinstance(inner, dict) else {}
        values = values[key]
    values[keys[-1]] = value


def _conflict(cause: ValidationError) -> tuple[str, ...]:
    """Return the keys of values that do not go together, from the section that refuses them."""
    error = cause.errors()[0].get("ctx", {}).get("error")
    return error.keys if isinstance(error, ConflictingValues) else ()


def refusal(cls: type, cause: ValidationError, where: str) -> BadConfiguration:
    """Return the error of the first value that a configuration refuses, in one line."""
    return BadConfiguration(_explain(cls, cause), where, key=".".join(_keys(cause)))


def _explain(cls: type, cause: ValidationError) -> str:
    """Return the first error in one line."""
    error = cause.errors()[0]
    path = _keys(cause)
    where = ".".join(path) or cls.__name__
    if error["type"] in UNEXPECTED:
        known = _keys_at(cls, path[:-1])
        close = _elsewhere(cls, path[-1], error["input"]) or difflib.get_close_matches(
            path[-1], known, 1
        )
        hint = f" Did you mean {close[0]!r}?" if close else ""
        return f"unknown key {where!r}.{hint} Known: {', '.join(known)}"
    if error["type"] in ("missing", "missing_argument"):
        return f"key {where!r} is missing"
    if error["type"] == "value_error" and isinstance(error["input"], Mapping):
        return str(error["ctx"]["error"])  # values that do not go together, each right by itself
    return f"{where!r} is {error['input']!r:.200}: {_expected(cause)}"


def _expected(cause: ValidationError) -> str:
    """Return what the first wrong value should be; of a union, every alternative."""
    errors = cause.errors()
    key = errors[0]["loc"]
    if not key or not _is_branch(key[-1]):
        return errors[0]["msg"].removeprefix("Value error, ")
    messages = [error["msg"] for error in errors if error["loc"][:-1] == key[:-1]]
    return " or ".join(
        [messages[0], *(each.removeprefix("Input should be ") for each in messages[1:])]
    )


def _keys(cause: ValidationError) -> list[str]:
    """Return the path of the key of the first error; an unexpected one may look like a branch."""
    error = cause.errors()[0]
    *path, last = error["loc"] or ("",)
    kept = [part for part in path if not _is_branch(part)]
    is_key = last != "" and (error["type"] in UNEXPECTED or not _is_branch(last))
    return [str(part) for part in (*kept, *([last] if is_key else []))]


def _is_branch(part: int | str) -> bool:
    """Return whether a key is the tried type of a union, which Pydantic puts between the keys."""
    return isinstance(part, str) and ("[" in part or part == "dataclass")


def _elsewhere(cls: type, key: str, value: object) -> list[str]:
    """Return the path of a key in a section of a configuration, if only one section has it, with
    the keys of its value as far as it has one alone, `track: {reward: {hands: 0.4}}`."""
    found = [[section, key] for section in _keys_at(cls, []) if key in _keys_at(cls, [section])]
    if len(found) != 1:
        return []
    path = found[0]
    while isinstance(value, Mapping) and len(value) == 1:
        key, value = next(iter(value.items()))
        if key not in _keys_at(cls, path):
            break
        path.append(key)
    return [".".join(path)]


def _keys_at(cls: Any, path: list[str]) -> list[str]:
    """Return the keys that a dataclass allows at a path; none where they are unknown."""
    for key in path:
        candidates = [c for c in (cls, *get_args(cls)) if is_dataclass(c)]
        if not candidates:
            return []
        cls = get_type_hints(candidates[0]).get(key)
    found = [c for c in (cls, *get_args(cls)) if is_dataclass(c)]
    return [field.name for field in fields(found[0])] if found else []
