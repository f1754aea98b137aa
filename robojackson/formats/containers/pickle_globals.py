"""The globals that a pickle of arrays may name, and what replaces each of them in our reader.

NumPy's types and functions become classes of our own, holding a shape and bytes; no function of
NumPy or joblib is called, and an array is created only if the file has as many bytes as its shape
needs.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from robojackson.errors import BadTable

NUMERIC_KINDS = "biufUS"
"""Kinds of allowed dtypes, numbers and text: an array of objects could hold anything."""


class Refused(BadTable):
    """A file that names something other than arrays, numbers and text."""


@dataclass
class NumberType:
    """`numpy.dtype` of a number."""

    name: str
    order: str = "="

    def __setstate__(self, state: Any) -> None:
        self.order = str(state[1])

    @property
    def dtype(self) -> np.dtype:
        """Return the type, its byte order set."""
        made = np.dtype(self.name)
        if made.kind not in NUMERIC_KINDS:
            raise Refused(f"refused, it asks for an array of {made}")
        return made.newbyteorder({"|": "="}.get(self.order, self.order))  # type: ignore[arg-type]


@dataclass
class Holder:
    """A placeholder that becomes an array when all of it has been read."""

    value: np.ndarray | None = None

    def __setstate__(self, state: Any) -> None:
        _, shape, kind, fortran, data = state
        self.value = from_bytes(data, kind, shape, "F" if fortran else "C")


@dataclass
class Wrapper:
    """joblib's mark that an array's bytes follow in the file."""

    state: dict[str, Any] = field(default_factory=dict)

    def __setstate__(self, state: Any) -> None:
        self.state = dict(state)


def from_bytes(data: object, kind: object, shape: Iterable[int], order: str) -> np.ndarray:
    """Return an array of plain numbers; the shape must match the number of bytes."""
    if not isinstance(kind, NumberType):
        raise Refused("refused, it asks for an array of objects")
    if not isinstance(data, bytes | bytearray):
        raise Refused("refused, it asks for an array of objects")
    array = np.frombuffer(bytes(data), kind.dtype)
    sizes = tuple(int(size) for size in shape)
    result: np.ndarray = array.reshape(sizes, order=order)  # type: ignore[call-overload]
    return result


def _number(kind: NumberType, data: object) -> float:
    value: float = from_bytes(data, kind, (1,), "C")[0].item()
    return value


def _text_bytes(text: str, encoding: str = "latin1") -> bytes:
    """Return the bytes that protocol 2 writes as text in Latin-1."""
    if encoding != "latin1":
        raise Refused(f"refused, it asks for the encoding {encoding!r}")
    return text.encode("latin1")


def _no_bytes() -> bytes:
    """Return zero bytes, as protocol 2 writes them."""
    return b""


def _array(*_: object) -> Holder:
    return Holder()


def _type(name: object, *_: object) -> NumberType:
    made = NumberType(str(name))
    assert made.dtype
    return made


def _from_buffer(
    data: object, kind: object, shape: Iterable[int], order: str, *_: object
) -> np.ndarray:
    return from_bytes(data, kind, shape, order)


_CORES = ("numpy.core", "numpy._core")
WORDS: Mapping[tuple[str, str], Any] = {
    ("numpy", "ndarray"): _array,
    ("numpy", "dtype"): _type,
    ("_codecs", "encode"): _text_bytes,
    ("__builtin__", "bytes"): _no_bytes,
    **{(f"{core}.multiarray", "_reconstruct"): _array for core in _CORES},
    **{(f"{core}.multiarray", "scalar"): _number for core in _CORES},
    **{(f"{core}.numeric", "_frombuffer"): _from_buffer for core in _CORES},
}
"""The globals that a file may name, and their replacements."""
JOBLIB = {**WORDS, ("joblib.numpy_pickle", "NumpyArrayWrapper"): Wrapper}
