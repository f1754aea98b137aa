"""Pickles of arrays, read without running anything: plain ones and those of joblib.

A pickle is a program; this reader knows the few instructions that make numbers, text and containers
(`pickle_globals`) and calls none of the functions that a file names. Python's own unpickler in C is
not used, because a file of 20 bytes can make it fill the memory (a memo index of 2^31).
"""

import io
import pickle
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from robojackson.errors import BadTable
from robojackson.formats.containers.pickle_globals import (
    JOBLIB,
    WORDS,
    Holder,
    NumberType,
    Refused,
    Wrapper,
    from_bytes,
)

DEEPEST, MOST_PARTS = 6, 1_000_000
"""Limits of a file: depth of nested containers, and number of items."""
BASE: Any = pickle._Unpickler
"""The unpickler that is written in Python; its memo is a dictionary."""


class Reader(BASE):  # type: ignore[misc]
    """An unpickler that knows only `words`."""

    dispatch: ClassVar[dict[int, Any]] = dict(BASE.dispatch)

    def __init__(
        self,
        source: io.BytesIO,
        words: Mapping[tuple[str, str], Any],
        persistent: Callable[[Any], Any] | None = None,
    ) -> None:
        super().__init__(source, encoding="latin1")
        self._source, self._words, self._persistent = source, words, persistent

    def find_class(self, module: str, name: str) -> Any:
        """Return the replacement of a global."""
        if (module, name) not in self._words:
            raise Refused(f"refused, it asks for {module}.{name}")
        word = self._words[(module, name)]
        return replace(word) if isinstance(word, NumberType) else word

    def persistent_load(self, key: Any) -> Any:
        """Return an item that is stored outside the pickle."""
        if self._persistent is None:
            raise Refused("refused, it asks for something outside the file")
        return self._persistent(key)

    def _refuse(self) -> None:
        raise Refused("refused, it asks for an object of a class")

    def _build(self) -> None:
        """Set the state of a replacement; no other object has one."""
        state, made = self.stack.pop(), self.stack[-1]
        if type(made) not in (NumberType, Holder, Wrapper):
            self._refuse()
        made.__setstate__(state)
        if isinstance(made, Wrapper):
            self.stack[-1] = _following(made.state, self._source)

    def _new(self) -> None:
        """Create joblib's wrapper; no other object is created without a call."""
        arguments, made = self.stack.pop(), self.stack.pop()
        if made is not Wrapper or arguments:
            self._refuse()
        self.append(Wrapper())

    def _reduce(self) -> None:
        """Call a replacement."""
        arguments, function = self.stack.pop(), self.stack[-1]
        if not any(function is word for word in self._words.values()):
            self._refuse()
        self.stack[-1] = function(*arguments)

    dispatch[pickle.BUILD[0]] = _build
    dispatch[pickle.NEWOBJ[0]] = _new
    dispatch[pickle.REDUCE[0]] = _reduce
    for _word in (pickle.INST, pickle.OBJ, pickle.NEWOBJ_EX, pickle.EXT1, pickle.EXT2, pickle.EXT4):
        dispatch[_word[0]] = _refuse


def load(data: bytes, where: str) -> dict[str, Any]:
    """Return the dictionary of a pickle: arrays, numbers, text, lists and dictionaries of them.

    Raises:
        BadTable: damaged, not a dictionary, or it holds anything but arrays of numbers.
    """
    return _read(data, WORDS, where)


def load_joblib(data: bytes, where: str) -> dict[str, Any]:
    """Return the dictionary of a file of `joblib.dump`, not compressed.

    Raises:
        BadTable: as `load`.
    """
    return _read(data, JOBLIB, where)


def _read(data: bytes, words: Mapping[tuple[str, str], Any], where: str) -> dict[str, Any]:
    if not data.startswith(pickle.PROTO):
        raise BadTable(
            f"{where}: empty, or not a pickle of protocol 2 or later; write it again with "
            "pickle.dump, or with joblib.dump and compress=0"
        )
    return read_with(Reader(io.BytesIO(data), words), where)


def read_with(reader: Reader, where: str) -> dict[str, Any]:
    """Return the dictionary that a reader makes."""
    try:
        content = to_arrays(reader.load())
    except Refused as cause:
        raise Refused(f"{where}: {cause}") from cause
    except Exception as cause:  # a damaged file fails in any way
        raise BadTable(f"{where}: damaged ({type(cause).__name__}: {cause})") from cause
    if not isinstance(content, dict):
        raise BadTable(f"{where}: holds a {type(content).__name__}, not a dictionary")
    return content


def to_arrays(value: Any) -> Any:
    """Return the same value with arrays in place of their placeholders."""
    budget = [MOST_PARTS]

    def walk(part: Any, depth: int) -> Any:
        budget[0] -= 1
        if depth > DEEPEST or budget[0] < 0:
            raise Refused("refused, it holds too many nested items")
        if isinstance(part, Holder):
            return np.zeros(0) if part.value is None else part.value
        if isinstance(part, dict):
            return {str(key): walk(inner, depth + 1) for key, inner in part.items()}
        if isinstance(part, list | tuple):
            return [walk(inner, depth + 1) for inner in part]
        return part

    return walk(value, 0)


def _following(state: dict[str, Any], source: io.BytesIO) -> np.ndarray:
    """Return the array whose bytes follow joblib's wrapper, after its padding."""
    shape, kind = tuple(int(size) for size in state["shape"]), state["dtype"]
    if not isinstance(kind, NumberType):
        raise Refused("refused, it asks for an array of objects")
    if state.get("numpy_array_alignment_bytes") is not None:
        source.read(source.read(1)[0])
    expected = kind.dtype.itemsize
    for size in shape:
        expected *= size
    rest = source.getbuffer().nbytes - source.tell()
    if not 0 <= expected <= rest:
        raise EOFError(f"an array of {expected} bytes, the file has {rest} more")
    return from_bytes(source.read(expected), kind, shape, str(state["order"]))
