"""Programs planted in files of arrays: each is refused, and nothing of it runs.

A payload is first read by Python's unpickler with every name replaced by a recorder, which proves
that it calls something; then by our readers, while an audit hook watches the interpreter.
"""

import builtins
import importlib
import io
import pickle
import struct
import sys
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robojackson.errors import BadTable
from robojackson.formats.containers import npz_archive, safe_pickle, torch_archive

MARK = "planted.txt"
FEWEST = 64
FUNCTIONS: tuple[tuple[str, str, tuple[Any, ...]], ...] = (
    ("os", "system", (f"touch {MARK}",)),
    ("posix", "system", (f"touch {MARK}",)),
    ("os", "popen", (f"touch {MARK}",)),
    ("os", "mkdir", (MARK,)),
    ("os", "makedirs", (MARK,)),
    ("os", "mkfifo", (MARK,)),
    ("os", "symlink", ("nowhere", MARK)),
    ("os", "open", (MARK, 65)),
    ("os", "remove", ("victim.txt",)),
    ("os", "execl", ("/bin/true", "true")),
    ("os", "spawnl", (0, "/bin/true", "true")),
    ("os", "_exit", (3,)),
    ("os", "kill", (0, 9)),
    ("os", "putenv", ("PLANTED", "1")),
    ("subprocess", "Popen", (["touch", MARK],)),
    ("subprocess", "call", (["touch", MARK],)),
    ("subprocess", "run", (["touch", MARK],)),
    ("subprocess", "check_output", (["touch", MARK],)),
    ("subprocess", "getoutput", (f"touch {MARK}",)),
    ("pty", "spawn", ("/bin/true",)),
    ("builtins", "eval", (f"open({MARK!r}, 'w')",)),
    ("builtins", "exec", (f"open({MARK!r}, 'w')",)),
    ("__builtin__", "eval", (f"open({MARK!r}, 'w')",)),
    ("builtins", "open", (MARK, "w")),
    ("io", "open", (MARK, "w")),
    ("builtins", "compile", ("1", "x", "eval")),
    ("builtins", "__import__", ("antigravity",)),
    ("builtins", "getattr", ("x", "join")),
    ("builtins", "breakpoint", ()),
    ("builtins", "input", ()),
    ("builtins", "bytearray", (10**9,)),
    ("importlib", "import_module", ("antigravity",)),
    ("runpy", "run_path", ("victim.txt",)),
    ("runpy", "run_module", ("this",)),
    ("shutil", "rmtree", ("victim",)),
    ("shutil", "copyfile", ("victim.txt", MARK)),
    ("pathlib", "Path", (MARK,)),
    ("pathlib", "Path.touch", (MARK,)),
    ("tempfile", "mkdtemp", ()),
    ("socket", "create_connection", (("127.0.0.1", 9),)),
    ("urllib.request", "urlopen", ("http://127.0.0.1:9/",)),
    ("webbrowser", "open", ("http://127.0.0.1:9/",)),
    ("ctypes", "CDLL", ("libc.so.6",)),
    ("ctypes", "string_at", (0,)),
    ("marshal", "loads", (b"\xe3",)),
    ("pickle", "loads", (b"cos\nsystem\n.",)),
    ("types", "FunctionType", ()),
    ("functools", "partial", (print, 1)),
    ("operator", "attrgetter", ("system",)),
    ("operator", "methodcaller", ("system", "true")),
    ("timeit", "timeit", (f"open({MARK!r}, 'w')",)),
    ("cProfile", "run", (f"open({MARK!r}, 'w')",)),
    ("pdb", "run", ("1",)),
    ("code", "interact", ()),
    ("sys", "exit", ()),
    ("signal", "raise_signal", (2,)),
    ("threading", "Thread", ()),
    ("multiprocessing", "Process", ()),
    ("logging.config", "listen", ()),
    ("sqlite3", "connect", (MARK,)),
    ("zipfile", "ZipFile", (MARK, "w")),
    ("numpy", "save", (MARK, 1)),
    ("numpy", "load", (MARK,)),
    ("numpy", "fromfile", (MARK,)),
    ("numpy", "memmap", (MARK, "u1", "w+")),
    ("numpy.testing", "rundocs", (MARK,)),
    ("numpy", "frompyfunc", (print, 1, 1)),
    ("numpy", "zeros", (10**10,)),
    ("torch", "load", (MARK,)),
    ("torch.hub", "load", ("a/b", "c")),
    ("torch.serialization", "load", (MARK,)),
    ("joblib", "load", (MARK,)),
    ("pandas", "read_pickle", (MARK,)),
    ("robojackson.files.file_tree", "FileTree", (MARK,)),
)
"""Module, name and arguments of what a file may want called."""


def value(given: object) -> bytes:
    """Return the opcodes of a value, of protocol 2; a function is what pickle writes for it."""
    return pickle.dumps(given, protocol=2)[2:-1]


def named(module: str, name: str) -> bytes:
    return f"c{module}\n{name}\n".encode()


def stacked(module: str, name: str) -> bytes:
    return value(module) + value(name) + b"\x93"


CALL = named("os", "mkdir")
ARGUMENTS = value((MARK,))
WHOLE = CALL + ARGUMENTS + b"R"
"""A directory, made by the opcode that calls."""
ARRAY, SCALAR = (named("numpy.core.multiarray", name) for name in ("_reconstruct", "scalar"))
SHAPES: dict[str, bytes] = {
    "by GLOBAL and REDUCE": WHOLE,
    "by STACK_GLOBAL": stacked("os", "mkdir") + value(MARK) + b"\x85R",
    "by INST": b"(" + value(MARK) + b"ios\nmkdir\n",
    "by OBJ": b"(" + CALL + value(MARK) + b"o",
    "by NEWOBJ": CALL + ARGUMENTS + b"\x81",
    "by NEWOBJ_EX": CALL + ARGUMENTS + b"}\x92",
    "with a name from the memo": CALL + b"q\x000h\x00" + ARGUMENTS + b"R",
    "with a name from the long memo": CALL + b"r\0\1\0\x000j\0\1\0\0" + ARGUMENTS + b"R",
    "with a name by MEMOIZE": CALL + b"\x940h\x00" + ARGUMENTS + b"R",
    "with arguments from the memo": ARGUMENTS + b"q\x630" + CALL + b"h\x63R",
    "with a name that is doubled": CALL + b"2" + ARGUMENTS + b"R0" + ARGUMENTS + b"R",
    "and thrown away": WHOLE + b"0}",
    "in a list": b"]" + WHOLE + b"a",
    "in a list of several": b"](" + value(1) + WHOLE + b"e",
    "in a tuple": WHOLE + b"\x85",
    "in a triple": WHOLE + value(1) + value(2) + b"\x87",
    "in a marked tuple": b"(" + WHOLE + b"t",
    "as a key": b"}" + WHOLE + value(1) + b"s",
    "as a value": b"}" + value("x") + WHOLE + b"s",
    "in a set": b"\x8f(" + WHOLE + b"\x90",
    "in a frozen set": b"(" + WHOLE + b"\x91",
    "in lists within lists": b"]" * 5 + WHOLE + b"a" * 5,
    "as the shape of an array": named("numpy", "ndarray") + WHOLE + b"R",
    "as a dtype's name": named("numpy", "dtype") + WHOLE + b"\x85R",
    "as an array's state": ARRAY + value(()) + b"R" + WHOLE + b"b",
    "as the bytes of a number": SCALAR + value((1, 2)) + WHOLE + b"0R",
    "in a state for BUILD": b"}" + value({"x": 1}) + WHOLE + b"0b",
    "of a state setter": named("builtins", "setattr") + CALL + value("x") + value(1) + b"\x87R",
    "as a protocol-4 frame": b"\x95" + struct.pack("<Q", len(WHOLE)) + WHOLE,
}  # fmt: skip
"""One call, written with different opcodes and in different places."""
OTHERS: dict[str, bytes] = {
    "an extension of one byte": b"\x82\x01",
    "an extension of two bytes": b"\x83\x01\x00",
    "an extension of four bytes": b"\x84\x01\x00\x00\x00",
    "an object from outside, by text": b"Pplanted\n",
    "an object from outside, by value": value("planted") + b"Q",
    "a buffer from outside": b"\x97",
    "a class with a state": named("numpy", "ndarray") + value({"a": 1}) + b"b",
    "a name of a private module": named("numpy.core.multiarray", "_reconstruct.__globals__"),
    "a dotted name": stacked("numpy", "os.system"),
    "a text that promises 2^62 bytes": b"\x8d" + struct.pack("<Q", 2**62) + b"x",
    "bytes that promise 2^62": b"\x8e" + struct.pack("<Q", 2**62) + b"x",
    "a byte array that promises 2^62": b"\x96" + struct.pack("<Q", 2**62) + b"x",
    "a number that promises 2^31 bytes": b"\x8b" + struct.pack("<i", 2**31 - 1) + b"x",
    "a frame that promises 2^62 bytes": b"\x95" + struct.pack("<Q", 2**62) + b"x",
    "a negative length": b"T" + struct.pack("<i", -1),
}
"""What calls nothing by name: other ways out of the file, and promises of memory."""


def program(words: bytes, protocol: int = 4) -> bytes:
    """Return a pickle of a dictionary that holds what the words make."""
    return b"\x80" + bytes([protocol]) + b"}" + value("x") + words + b"s."


def call(module: str, name: str, arguments: tuple[Any, ...]) -> bytes:
    return program(stacked(module, name) + value(arguments) + b"R")


PAYLOADS: dict[str, bytes] = {
    **{f"{module}.{name}": call(module, name, given) for module, name, given in FUNCTIONS},
    **{f"a call {how}": program(words) for how, words in SHAPES.items()},
}
ALL = PAYLOADS | {what: program(words) for what, words in OTHERS.items()}


class Recorder(pickle._Unpickler):  # type: ignore[name-defined,misc]
    """Python's unpickler, in which every name is a class that only notes that it was called."""

    def __init__(self, data: bytes) -> None:
        super().__init__(io.BytesIO(data))
        self.named: list[str] = []

    def find_class(self, module: str, name: str) -> type:
        self.named.append(f"{module}.{name}")
        return type("Stand", (), {"__new__": lambda cls, *_, **__: object.__new__(cls)})


WATCHED = ("os.", "subprocess.", "socket.", "ctypes.", "shutil.", "exec", "import", "open", "pty.")
_events: list[str] | None = None


def _hook(event: str, _: object) -> None:
    if _events is not None and event.startswith(WATCHED):
        _events.append(event)


sys.addaudithook(_hook)


@pytest.fixture
def events(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """Yield the audit events of the interpreter in a folder of its own, the readers loaded
    before."""
    global _events
    monkeypatch.chdir(tmp_path)
    importlib.import_module("torch")
    safe_pickle.load(pickle.dumps({"x": np.ones(2)}), "warm")
    for protocol in (0, 2):  # the codecs of names in an archive and of text
        torch_archive.load(zipped("archive/data.pkl", pickle.dumps({"x": 1}, protocol)), "warm")
    _events = found = []
    yield found
    _events = None


def refused(read: Callable[..., object], data: bytes, events: list[str], *words: object) -> None:
    events.clear()
    with pytest.raises(BadTable):
        read(data, *words, "file")
    assert events == []
    assert list(Path().iterdir()) == []


def zipped(name: str, content: bytes) -> bytes:
    sink = io.BytesIO()
    with zipfile.ZipFile(sink, "w") as archive:
        archive.writestr(name, content)
    return sink.getvalue()


def npy(content: bytes) -> bytes:
    """Return an array of one object, as NumPy writes it before the pickle."""
    sink = io.BytesIO()
    header = {"descr": "|O", "fortran_order": False, "shape": (1,)}
    np.lib.format.write_array_header_1_0(sink, header)
    return sink.getvalue() + content


def test_there_are_as_many_as_the_report_says() -> None:
    assert len(set(ALL.values())) == len(ALL) >= FEWEST


@pytest.mark.parametrize("what", PAYLOADS)
def test_a_payload_names_what_it_would_call(what: str) -> None:
    recorder = Recorder(PAYLOADS[what])
    try:
        recorder.load()
    except Exception:
        assert recorder.named  # stopped by the stand-in, after the name
    assert set(recorder.named) - {"numpy.ndarray", "numpy.dtype"}


@pytest.mark.parametrize("what", ALL)
def test_a_planted_pickle_is_refused(what: str, events: list[str]) -> None:
    refused(safe_pickle.load, ALL[what], events)
    refused(safe_pickle.load_joblib, ALL[what], events)


@pytest.mark.parametrize("what", ALL)
def test_a_planted_torch_file_is_refused(what: str, events: list[str]) -> None:
    refused(torch_archive.load, zipped("archive/data.pkl", ALL[what]), events)
    refused(torch_archive.load, ALL[what], events)


@pytest.mark.parametrize("what", ALL)
def test_a_planted_array_of_objects_is_refused(what: str, events: list[str]) -> None:
    refused(npz_archive.unpack, zipped("x.npy", npy(ALL[what])), events, ("x",))
    refused(npz_archive.unpack, zipped("x.npy", ALL[what]), events, ("x",))


class Shell:
    """What pickle itself writes of an object that runs something."""

    def __reduce__(self) -> tuple[object, ...]:
        return builtins.eval, (f"open({MARK!r}, 'w')",)


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_a_payload_of_every_protocol_is_refused(protocol: int, events: list[str]) -> None:
    data = pickle.dumps({"x": [Shell()]}, protocol=protocol)
    refused(safe_pickle.load, data, events)
    refused(safe_pickle.load_joblib, data, events)
    refused(torch_archive.load, zipped("archive/data.pkl", data), events)


def test_a_second_program_after_the_first_is_not_run(events: list[str]) -> None:
    """Python's `load` stops at the first end, too; what follows is not looked at."""
    events.clear()
    assert safe_pickle.load(pickle.dumps({"x": 1}) + PAYLOADS["os.mkdir"], "file") == {"x": 1}
    assert events == []
