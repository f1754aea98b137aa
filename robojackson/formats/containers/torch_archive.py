"""The `.pt` of PyTorch: a zip of a pickle and raw numbers; `torch.save` writes it.

Read without PyTorch: dictionaries of tensors, numbers and text, nothing executed. Members must be
stored, as `torch.save` does, and tensors are views of them, so that reading takes no more memory
than a few times the size of the file. `torch.load(weights_only=True)` executes no code either, but
calls `bytearray` and `OrderedDict` with arguments of the file: 400 bytes fill 4 GB.
"""

import io
import zipfile
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import as_strided

from robojackson.errors import BadTable
from robojackson.formats.containers.npz_archive import ZIP_FAILURES
from robojackson.formats.containers.pickle_globals import WORDS, NumberType, Refused
from robojackson.formats.containers.safe_pickle import Reader, read_with

STORAGES: Mapping[str, str] = {
    "FloatStorage": "f4", "DoubleStorage": "f8", "HalfStorage": "f2", "LongStorage": "i8",
    "IntStorage": "i4", "ShortStorage": "i2", "CharStorage": "i1", "ByteStorage": "u1",
    "BoolStorage": "?",
}  # fmt: skip
MOST_NUMBERS = 100_000_000
"""Largest number of values in one tensor; a stride of zero repeats four bytes without end."""


def load(data: bytes, where: str) -> dict[str, Any]:
    """Return the dictionary of a `.pt`, tensors as arrays.

    Raises:
        BadTable: no such file, damaged, or it holds anything but tensors of numbers.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return _load(archive, len(data), where)
    except ZIP_FAILURES as cause:
        raise BadTable(f"{where}: not a .pt of PyTorch 1.6 or later ({cause})") from cause


def _load(archive: zipfile.ZipFile, size: int, where: str) -> dict[str, Any]:
    members = {info.filename: info for info in archive.infolist()}
    programs = [name for name in members if name.endswith("/data.pkl") or name == "data.pkl"]
    if len(programs) != 1:
        raise BadTable(f"{where}: a zip without data.pkl; torch.save writes one")
    if any(info.compress_type != zipfile.ZIP_STORED for info in members.values()):
        raise Refused(f"{where}: refused, it is compressed; torch.save compresses nothing")
    if sum(info.file_size for info in members.values()) > size:
        raise Refused(f"{where}: refused, its members hold more bytes than the file")
    folder = programs[0].removesuffix("data.pkl")

    @cache
    def record(name: str) -> bytes:
        return archive.read(f"{folder}data/{name}")

    def storage(key: Any) -> np.ndarray:
        _, kind, name, *_ = key
        if not isinstance(kind, NumberType):
            raise Refused("refused, it asks for a storage of objects")
        return np.frombuffer(record(name), kind.dtype)

    source = io.BytesIO(archive.read(programs[0]))
    return read_with(Reader(source, TORCH, storage), where)


def _tensor(storage: Any, offset: int, size: Any, stride: Any, *_: Any) -> np.ndarray:
    shape, steps = [int(n) for n in size], [int(n) for n in stride]
    count = int(np.prod(shape, dtype=object)) if shape else 1
    if min([offset, *shape, *steps, 0]) < 0 or count > MOST_NUMBERS:
        raise Refused(f"refused, it asks for a tensor of shape {shape} and stride {steps}")
    last = offset + sum((n - 1) * step for n, step in zip(shape, steps, strict=True))
    if count and last >= len(storage):
        raise EOFError(f"a tensor of {last + 1} numbers, its storage has {len(storage)}")
    width = storage.itemsize
    strides = [step * width for step in steps]
    return as_strided(storage[offset:], shape, strides, writeable=False)


def _parameter(tensor: Any, *_: Any) -> Any:
    return tensor


def _dictionary(pairs: Any = ()) -> dict[Any, Any]:
    if not isinstance(pairs, list | tuple):  # each row of an array would become a pair
        raise Refused("refused, it asks for a dictionary of something other than pairs")
    return dict(pairs)


TORCH: Mapping[tuple[str, str], Any] = {
    **WORDS,
    ("torch._utils", "_rebuild_tensor_v2"): _tensor,
    ("torch._utils", "_rebuild_parameter"): _parameter,
    ("collections", "OrderedDict"): _dictionary,
    **{("torch", name): NumberType(kind) for name, kind in STORAGES.items()},
}
"""The globals that a file may name, and their replacements."""


def save(content: Mapping[str, object]) -> bytes:
    """Return a `.pt` that `torch.load(weights_only=True)` reads; arrays become float32 tensors."""
    import torch

    def tensors(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {key: tensors(inner) for key, inner in value.items()}
        if isinstance(value, np.ndarray):
            return torch.from_numpy(np.array(value, np.float32, order="C"))
        return value

    sink = io.BytesIO()
    torch.save(tensors(content), sink)
    return sink.getvalue()
