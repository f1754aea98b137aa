"""The `.pt` of PyTorch (a zip of a pickle and raw numbers), read and written without PyTorch.

Read: dictionaries of tensors, numbers and text, nothing executed. Members must be stored, as
`torch.save` does, so that a file never holds more than its own size.
"""

import io
import pickle
import zipfile
from collections.abc import Mapping
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
PICKLER: Any = pickle._Pickler
"""The pickler that is written in Python; that in C has no `save`."""
MOST_NUMBERS = 100_000_000
"""In one tensor; a stride of zero lets four bytes look like any number of them."""


def load(data: bytes, where: str) -> dict[str, Any]:
    """The dictionary of a `.pt`, tensors as arrays.

    Raises:
        BadTable: no such file, damaged, or it asks for anything but tensors of numbers.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return _load(archive, where)
    except ZIP_FAILURES as cause:
        raise BadTable(f"{where}: not a .pt of PyTorch 1.6 or later ({cause})") from cause


def _load(archive: zipfile.ZipFile, where: str) -> dict[str, Any]:
    members = {info.filename: info for info in archive.infolist()}
    programs = [name for name in members if name.endswith("/data.pkl") or name == "data.pkl"]
    if len(programs) != 1:
        raise BadTable(f"{where}: a zip without data.pkl; torch.save writes one")
    if any(info.compress_type != zipfile.ZIP_STORED for info in members.values()):
        raise Refused(f"{where}: refused, it is compressed; torch.save compresses nothing")
    folder = programs[0].removesuffix("data.pkl")

    def storage(key: Any) -> np.ndarray:
        _, kind, name, *_ = key
        if not isinstance(kind, NumberType):
            raise Refused("refused, it asks for a storage of objects")
        return np.frombuffer(archive.read(f"{folder}data/{name}"), kind.dtype)

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
    return as_strided(storage[offset:], shape, [step * width for step in steps]).copy()


def _parameter(tensor: Any, *_: Any) -> Any:
    return tensor


def _dictionary(*pairs: Any) -> dict[Any, Any]:
    return dict(*pairs)


TORCH: Mapping[tuple[str, str], Any] = {
    **WORDS,
    ("torch._utils", "_rebuild_tensor_v2"): _tensor,
    ("torch._utils", "_rebuild_parameter"): _parameter,
    ("collections", "OrderedDict"): _dictionary,
    **{("torch", name): NumberType(kind) for name, kind in STORAGES.items()},
}
"""What a file may name, and what stands for it here."""


def save(content: Mapping[str, Any]) -> bytes:
    """A `.pt` that `torch.load(weights_only=True)` reads; arrays become float32 tensors."""
    sink, storages = io.BytesIO(), []  # type: ignore[var-annotated]
    _Writer(sink, storages).dump(content)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr("archive/data.pkl", sink.getvalue())
        archive.writestr("archive/byteorder", b"little")
        for index, numbers in enumerate(storages):
            archive.writestr(f"archive/data/{index}", numbers.astype("<f4").tobytes())
        archive.writestr("archive/version", b"3\n")
    return out.getvalue()


class _Name:
    """A global of PyTorch that is written by its name."""

    def __init__(self, module: str, name: str) -> None:
        self.module, self.name = module, name


class _Writer(PICKLER):
    """A pickler that writes arrays as PyTorch writes tensors."""

    def __init__(self, sink: io.BytesIO, storages: list[np.ndarray]) -> None:
        super().__init__(sink, protocol=2)
        self._storages = storages

    def persistent_id(self, value: Any) -> Any:
        """A storage is kept outside the pickle."""
        if not isinstance(value, _Storage):
            return None
        self._storages.append(value.numbers)
        kind = _Name("torch", "FloatStorage")
        return ("storage", kind, str(len(self._storages) - 1), "cpu", value.numbers.size)

    def save(self, value: Any, save_persistent_id: bool = True) -> None:
        """Arrays and names in PyTorch's words, all else as it is."""
        if isinstance(value, _Name):
            self.write(pickle.GLOBAL + f"{value.module}\n{value.name}\n".encode())
        elif isinstance(value, np.ndarray):
            self._tensor(np.ascontiguousarray(value))
        else:
            super().save(value, save_persistent_id)

    def _tensor(self, value: np.ndarray) -> None:
        stride = tuple(step // value.itemsize for step in value.strides)
        self.save(_Name("torch._utils", "_rebuild_tensor_v2"))
        self.write(pickle.MARK)
        for part in (_Storage(value.ravel()), 0, tuple(value.shape), stride, False):
            self.save(part)
        self.save(_Name("collections", "OrderedDict"))
        self.write(pickle.EMPTY_TUPLE + pickle.REDUCE + pickle.TUPLE + pickle.REDUCE)


class _Storage:
    """Numbers that stand outside the pickle."""

    def __init__(self, numbers: np.ndarray) -> None:
        self.numbers = numbers
