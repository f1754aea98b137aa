"""Reading foreign pickles runs nothing: plain ones, joblib's and PyTorch's."""

import io
import os
import pickle
import struct
import tracemalloc
import zipfile
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from robojackson.errors import BadTable
from robojackson.formats.containers import npz_archive, safe_pickle, torch_archive

ARRAYS = {
    "single": np.arange(12, dtype=np.float32).reshape(3, 4),
    "turned": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
    "big_endian": np.arange(4, dtype=">i4"),
    "words": np.array(["one", "three"]),
    "flags": np.array([True, False]),
    "point": np.array(2.5),
    "none": np.zeros((0, 3)),
}


class Wrap:
    """joblib's mark for an array, by the name that joblib gives it."""

    def __init__(self, array: np.ndarray, aligned: bool) -> None:
        order = "F" if array.flags.f_contiguous and not array.flags.c_contiguous else "C"
        self.state = {"subclass": np.ndarray, "shape": array.shape, "order": order}
        self.state |= {"dtype": array.dtype, "allow_mmap": True}
        if aligned:
            self.state["numpy_array_alignment_bytes"] = 16


class JoblibWriter(pickle._Pickler):  # type: ignore[name-defined,misc]
    """Writes as joblib 1 does: the mark, a padding to 16 bytes, the numbers."""

    def __init__(self, sink: io.BytesIO, aligned: bool) -> None:
        super().__init__(sink, protocol=4)
        self.sink, self.aligned = sink, aligned
        self.framer.start_framing = lambda: None

    def save(self, value: Any, save_persistent_id: bool = True) -> None:
        if not isinstance(value, np.ndarray):
            super().save(value)
            return
        wrapped = Wrap(value, self.aligned)
        self.write(pickle.GLOBAL + b"joblib.numpy_pickle\nNumpyArrayWrapper\n")
        self.write(pickle.EMPTY_TUPLE + pickle.NEWOBJ)
        super().save(wrapped.state)
        self.write(pickle.BUILD)
        if self.aligned:
            padding = 16 - (self.sink.tell() + 1) % 16
            self.write(bytes([padding]) + b"\xff" * padding)
        self.write(value.tobytes(order=wrapped.state["order"]))


def joblib_file(content: Any, aligned: bool = True) -> bytes:
    sink = io.BytesIO()
    JoblibWriter(sink, aligned).dump(content)
    return sink.getvalue()


def torch_file(content: Any) -> bytes:
    sink = io.BytesIO()
    torch.save(content, sink)
    return sink.getvalue()


READERS: dict[str, tuple[Callable[..., dict[str, Any]], Callable[[Any], bytes]]] = {
    "pickle": (safe_pickle.load, pickle.dumps),
    "joblib": (safe_pickle.load_joblib, joblib_file),
    "torch": (torch_archive.load, torch_file),
}


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
def test_a_pickled_array_is_the_same_array(name: str, protocol: int) -> None:
    back = safe_pickle.load(pickle.dumps({"x": ARRAYS[name]}, protocol=protocol), "x")["x"]
    np.testing.assert_array_equal(back, ARRAYS[name])


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize("aligned", [True, False])
def test_an_array_of_joblib_is_the_same_array(name: str, aligned: bool) -> None:
    content = {"before": [1, "two"], "x": ARRAYS[name], "after": ARRAYS["single"]}
    back = safe_pickle.load_joblib(joblib_file(content, aligned), "x")
    np.testing.assert_array_equal(back["x"], ARRAYS[name])
    np.testing.assert_array_equal(back["after"], ARRAYS["single"])
    assert back["before"] == [1, "two"]


@pytest.mark.parametrize(
    "tensor",
    [
        torch.arange(6.0).reshape(2, 3),
        torch.arange(6.0).reshape(2, 3).T,
        torch.arange(9)[2:7:2],
        torch.ones(3, dtype=torch.float64).expand(4, 3),
        torch.tensor(2),
        torch.nn.Parameter(torch.ones(2)).detach(),
        torch.tensor([True, False]),
    ],
)
def test_a_tensor_is_read_as_the_same_array(tensor: torch.Tensor) -> None:
    back = torch_archive.load(torch_file({"a": {"x": tensor}}), "x")["a"]["x"]
    np.testing.assert_array_equal(back, tensor.numpy())


class Trap:
    """What runs a function where it is unpickled."""

    def __init__(self, function: Any, *arguments: Any) -> None:
        self.call = function, arguments

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        return self.call


def trap(kind: str, mark: Path) -> Any:
    return {
        "a shell": lambda: Trap(os.system, f"touch {mark}"),
        "an expression": lambda: Trap(eval, f"open({str(mark)!r}, 'w')"),
        "a file": lambda: Trap(open, str(mark), "w"),
        "a path": lambda: mark,
        "objects": lambda: np.array([Trap(open, str(mark), "w")], dtype=object),
    }[kind]()


KINDS = ("a shell", "an expression", "a file", "a path", "objects")


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_file_that_calls_something_is_refused(reader: str, kind: str, tmp_path: Path) -> None:
    read, write = READERS[reader]
    mark = tmp_path / "mark"
    if (reader, kind) == ("joblib", "objects"):
        data = joblib_file({"x": np.zeros(1, object)})
    else:
        data = write({"x": trap(kind, mark)})
    with pytest.raises(BadTable, match="refused, it asks for"):
        read(data, "file")
    assert not mark.exists()


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("share", [0.0, 0.2, 0.6, 0.98])
def test_a_file_that_is_cut_off_is_reported(reader: str, share: float) -> None:
    read, write = READERS[reader]
    value = torch.ones(50) if reader == "torch" else np.ones(50)
    data = write({"x": value})
    with pytest.raises(BadTable, match="file"):
        read(data[: int(share * len(data))], "file")


@pytest.mark.parametrize("reader", READERS)
def test_what_is_no_dictionary_is_reported(reader: str) -> None:
    read, write = READERS[reader]
    with pytest.raises(BadTable, match="holds a list, not a dictionary"):
        read(write([1, 2]), "file")


BUILD_ON_CLASS = b"cnumpy\nndarray\n}(X\x01\x00\x00\x00aK\x01ub."
MEMO_OF_64_GIB = b"N" + b"r" + struct.pack("<I", 2**31) + b"."
NESTED = b"(" * 100_000 + b"l" * 100_000 + b"."
EXTENSION = b"\x82\x01."
OWN_CLASS = b"(cos\nsystem\nX\x02\x00\x00\x00lso."


@pytest.mark.parametrize("words", [BUILD_ON_CLASS, NESTED, EXTENSION, OWN_CLASS])
def test_a_wicked_program_is_reported(words: bytes) -> None:
    with pytest.raises(BadTable):
        safe_pickle.load(b"\x80\x02" + words, "file")


def test_a_huge_memo_index_takes_no_memory() -> None:
    """Python's reader in C would make a list of 2^31 places."""
    with pytest.raises(BadTable, match="holds a NoneType"):
        safe_pickle.load(b"\x80\x02" + MEMO_OF_64_GIB, "file")


def test_lists_within_lists_that_double_are_refused() -> None:
    value: Any = [0]
    for _ in range(5):
        value = [value] * 100
    with pytest.raises(BadTable, match="too many nested items"):
        safe_pickle.load(pickle.dumps({"x": value}), "file")


def test_joblibs_array_that_promises_too_much_is_reported() -> None:
    data = joblib_file({"x": np.zeros((7, 3))})
    swollen = data.replace(pickle.dumps((7, 3), 2)[2:6], b"J\xff\xff\xff\x7fK\x03")
    assert swollen != data
    with pytest.raises(BadTable, match="the file has"):
        safe_pickle.load_joblib(swollen, "file")


def test_a_tensor_that_repeats_itself_without_end_is_refused() -> None:
    huge = torch.ones(1).expand(10**12)
    with pytest.raises(BadTable, match="refused, it asks for a tensor"):
        torch_archive.load(torch_file({"x": huge}), "file")


def peak_bytes(read: Callable[[], Any]) -> int:
    tracemalloc.start()
    try:
        read()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_many_tensors_of_the_same_numbers_take_little_more_memory_than_the_file() -> None:
    """Each alone is small enough; copied, they would fill 8 GB."""
    one, many = torch.ones(250_000), torch.ones(1).expand(10**8)
    data = torch_file({"a": {str(i): many for i in range(20)}, "b": [one[i:] for i in range(100)]})
    assert peak_bytes(lambda: torch_archive.load(data, "file")) < 4 * len(data)


def test_a_dictionary_of_an_arrays_rows_is_refused() -> None:
    """`torch.load(weights_only=True)` makes a tensor of each row; 10**7 of them fill 14 GB."""
    rows = torch.ones(1).expand(10**6, 2)
    with pytest.raises(BadTable, match="something other than pairs"):
        torch_archive.load(torch_file({"x": Trap(OrderedDict, rows)}), "file")


def test_pytorchs_own_reader_takes_the_memory_that_a_file_asks_for() -> None:
    """If this passes no more, PyTorch has mended it and the reader of `torch_archive` can go."""
    data = torch_file({"x": Trap(bytearray, 10**7)})
    assert len(torch.load(io.BytesIO(data), weights_only=True)["x"]) > 1000 * len(data)
    with pytest.raises(BadTable, match=r"refused, it asks for __builtin__\.bytearray"):
        torch_archive.load(data, "file")


def test_a_dictionary_of_pairs_is_read() -> None:
    back = torch_archive.load(torch_file({"x": Trap(OrderedDict, [("a", 1)])}), "file")
    assert back == {"x": {"a": 1}}


def test_members_that_overlap_are_refused() -> None:
    """So that one record cannot be read under a thousand names."""
    data = bytearray(torch_archive.save({"x": np.ones(4), "y": np.ones(4)}))
    entry = data.rindex(b"archive/data/1") - 46  # of the central directory; sizes at byte 20
    data[entry + 20 : entry + 28] = struct.pack("<II", len(data), len(data))
    with pytest.raises(BadTable, match="more bytes than the file"):
        torch_archive.load(bytes(data), "file")


def test_a_tensor_that_reaches_outside_its_storage_is_refused() -> None:
    data = torch_archive.save({"x": np.ones(4)})
    assert b"K\x04" in data
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    parts["archive/data/0"] = parts["archive/data/0"][:8]
    sink = io.BytesIO()
    with zipfile.ZipFile(sink, "w") as archive:
        for name, part in parts.items():
            archive.writestr(name, part)
    with pytest.raises(BadTable, match="its storage has 2"):
        torch_archive.load(sink.getvalue(), "file")


def zipped(name: str, content: bytes) -> bytes:
    sink = io.BytesIO()
    with zipfile.ZipFile(sink, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, content)
    return sink.getvalue()


def test_a_compressed_pt_is_refused_before_it_is_unpacked() -> None:
    with pytest.raises(BadTable, match="compressed"):
        torch_archive.load(zipped("archive/data.pkl", bytes(10**7)), "file")


def npy(shape: tuple[int, ...], content: bytes) -> bytes:
    sink = io.BytesIO()
    header = {"descr": "<f8", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(sink, header)
    return sink.getvalue() + content


@pytest.mark.parametrize("shape", [(10**12,), (2**40, 2**40), (3,)])
def test_an_npz_whose_header_promises_another_size_is_reported(shape: tuple[int, ...]) -> None:
    with pytest.raises(BadTable, match="declared"):
        npz_archive.unpack(zipped("x.npy", npy(shape, bytes(8))), ("x",), "file")


def test_an_npz_that_unpacks_to_too_much_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(npz_archive, "MOST_NUMBERS", 10**5)
    with pytest.raises(BadTable, match="at most 100,000 are read"):
        npz_archive.unpack(zipped("x.npy", npy((10**6,), bytes(8 * 10**6))), ("x",), "file")


def test_objects_in_an_npz_are_not_unpickled() -> None:
    sink = io.BytesIO()
    np.savez(sink, x=np.array([{"a": 1}], dtype=object))
    with pytest.raises(BadTable, match="Python objects"):
        npz_archive.unpack(sink.getvalue(), ("x",), "file")
