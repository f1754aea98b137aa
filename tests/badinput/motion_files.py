"""Files of other projects: archives, pickles, BVH and csv, damaged, hostile and too large."""

import io
import pickle
import struct
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np

from tests.badinput.base import BASE
from tests.badinput.case import Case, Maker, writes
from tests.badinput.tables import damaged
from tests.mocap.test_imported_motion import res_pk

OUT = ("-o", "out")
Arrays = dict[str, np.ndarray]


class Evil:
    """What runs a program when it is unpickled."""

    def __reduce__(self) -> tuple[object, ...]:
        import os

        return os.system, ("touch planted",)


def amass(**changes: object) -> Maker:
    """Return a maker of an AMASS archive with other arrays; `...` removes one."""

    def make(here: Path) -> None:
        with np.load(BASE / "amass.npz") as archive:
            arrays = dict(archive)
        for name, value in changes.items():
            if value is ...:
                arrays.pop(name, None)
            else:
                arrays[name] = value(arrays) if callable(value) else np.asarray(value)
        np.savez(here / "a.npz", **arrays)

    return make


def sized(poses: int) -> Maker:
    """Return a compressed archive of a number of frames of zeros."""

    def make(here: Path) -> None:
        zeros = {"poses": np.zeros((poses, 156), np.float32), "trans": np.zeros((poses, 3))}
        np.savez_compressed(here / "a.npz", **zeros, mocap_framerate=np.array(120.0))

    return make


def lying(shape: tuple[int, ...], kind: str = "<f8") -> Maker:
    """Return an array whose header promises more than the file holds."""

    def make(here: Path) -> None:
        head = str({"descr": kind, "fortran_order": False, "shape": shape}).encode()
        head += b" " * (118 - len(head) % 118 if len(head) > 118 else 118 - len(head)) + b"\n"
        content = b"\x93NUMPY\x01\0" + struct.pack("<H", len(head)) + head + bytes(64)
        with zipfile.ZipFile(here / "a.npz", "w") as archive:
            archive.writestr("poses.npy", content)
            archive.writestr("trans.npy", content)

    return make


def pickled(value: Callable[[], object], name: str = "a.pkl", protocol: int = 4) -> Maker:
    """Return a maker of a pickle."""
    return lambda here: (here / name).write_bytes(pickle.dumps(value(), protocol))


def _zip_bomb(here: Path) -> None:
    with zipfile.ZipFile(here / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("poses.npy", bytes(600_000_000))
        archive.writestr("trans.npy", b"x")


def bvh(edit: Callable[[str], str]) -> Maker:
    """Return a maker of a BVH with one thing wrong."""
    return lambda here: (here / "a.bvh").write_text(edit((BASE / "motion.bvh").read_text()))


def csv(edit: Callable[[str], str]) -> Maker:
    """Return a maker of a csv with one thing wrong."""
    return lambda here: (here / "a.csv").write_text(edit((BASE / "motion.csv").read_text()))


def _entry(text: str, value: str) -> str:
    lines = text.split("\n")
    cells = lines[9].split(",")
    lines[9] = ",".join([*cells[:-9], value, *cells[-8:]])
    return "\n".join(lines)


NPZ: Mapping[str, Maker] = {
    "no trans": amass(trans=...),
    "no poses": amass(poses=...),
    "poses of objects": amass(poses=lambda a: np.array([Evil()], object)),
    "poses of text": amass(poses=lambda a: np.array(["x"] * 9)),
    "poses complex": amass(poses=lambda a: a["poses"].astype(complex)),
    "poses nan": amass(poses=lambda a: a["poses"] * np.nan),
    "poses 1e30": amass(poses=lambda a: a["poses"] + 1e30),
    "poses of 100": amass(poses=lambda a: a["poses"][:, :100]),
    "poses flat": amass(poses=lambda a: a["poses"].ravel()),
    "poses of four axes": amass(poses=lambda a: a["poses"][None, None]),
    "one frame": amass(poses=lambda a: a["poses"][:1], trans=lambda a: a["trans"][:1]),
    "no frame": amass(poses=lambda a: a["poses"][:0], trans=lambda a: a["trans"][:0]),
    "trans shorter": amass(trans=lambda a: a["trans"][:-3]),
    "trans infinite": amass(trans=lambda a: a["trans"] + np.inf),
    "trans of 1e20": amass(trans=lambda a: a["trans"] + 1e20),
    "trans of 1e7": amass(
        trans=lambda a: a["trans"] + 9e6 * np.arange(len(a["trans"]))[:, None] / 100
    ),
    "poses of dates": amass(poses=lambda a: a["poses"].astype("M8[s]")),
    "poses of truths": amass(poses=lambda a: a["poses"] > 0),
    "rate 0": amass(mocap_framerate=0.0),
    "rate negative": amass(mocap_framerate=-30.0),
    "rate nan": amass(mocap_framerate=np.nan),
    "rate 1e9": amass(mocap_framerate=1e9),
    "rate of text": amass(mocap_framerate=np.array("x")),
    "skeleton of zeros": amass(rest_joints=np.zeros((29, 3))),
    "skeleton huge": amass(rest_joints=np.full((29, 3), 1e9)),
    "a million frames": sized(1_000_000),
    "lying head": lying((10**9, 156)),
    "head of 2^62": lying((2**62,)),
    "negative shape": lying((-5, 156)),
    "objects promised": lying((3,), "|O"),
    "zip bomb": _zip_bomb,
    "empty zip": writes("a.npz", b"PK\x05\x06" + bytes(18)),
    "path in a zip": lambda here: _member(here, "../../poses.npy"),
    "cut": lambda here: (here / "a.npz").write_bytes((BASE / "amass.npz").read_bytes()[:5000]),
}
TEXTS: Mapping[str, Maker] = {
    "bvh: one word": writes("a.bvh", "HIERARCHY"),
    "bvh: endless braces": writes("a.bvh", "HIERARCHY\nROOT a\n" + "{\n" * 10_000),
    "bvh: 2000 joints": writes("a.bvh", "HIERARCHY ROOT r { " + "JOINT a { OFFSET 0 0 0 " * 2000),
    "bvh: frames -1": bvh(lambda t: t.replace("Frames: 120", "Frames: -1")),
    "bvh: frames 10^12": bvh(lambda t: t.replace("Frames: 120", f"Frames: {10**12}")),
    "bvh: frames of text": bvh(lambda t: t.replace("Frames: 120", "Frames: many")),
    "bvh: frame time 0": bvh(lambda t: t.replace("Frame Time: 0.0333333333", "Frame Time: 0")),
    "bvh: frame time nan": bvh(lambda t: t.replace("Frame Time: 0.0333333333", "Frame Time: nan")),
    "bvh: offset nan": bvh(lambda t: t.replace("OFFSET 0.0", "OFFSET nan", 1)),
    "bvh: channels 10^9": bvh(lambda t: t.replace("CHANNELS 3", f"CHANNELS {10**9}", 1)),
    "bvh: channels -3": bvh(lambda t: t.replace("CHANNELS 3", "CHANNELS -3", 1)),
    "bvh: channels twice": bvh(
        lambda t: t.replace("CHANNELS 3", "CHANNELS 3 Xrotation Yrotation Zrotation CHANNELS 3", 1)
    ),
    "bvh: no motion": bvh(lambda t: t.split("MOTION")[0]),
    "bvh: cut": bvh(lambda t: t[: len(t) // 2]),
    "bvh: numbers of text": bvh(lambda t: t[:-30] + " x y z\n"),
    "bvh: numbers of 1e300": bvh(lambda t: t[:-12] + " 1e300\n"),
    "bvh: deep": writes("a.bvh", "HIERARCHY ROOT a { OFFSET 0 0 0 " + "} " * 5000),
    "bvh: invalid utf-8": writes("a.bvh", b"HIERARCHY\nROOT \xff\xfe{"),
    "csv: head alone": csv(lambda t: t.split("\n")[0]),
    "csv: cut": csv(lambda t: t[: len(t) // 2]),
    "csv: nan": csv(lambda t: _entry(t, "nan")),
    "csv: text": csv(lambda t: _entry(t, "hello")),
    "csv: formula": csv(lambda t: _entry(t, "=cmd|'/c calc'!A0")),
    "csv: 1e300": csv(lambda t: _entry(t, "1e300")),
    "csv: other head": csv(lambda t: t.replace("pelvis_x", "x")),
    "csv: time stands": csv(lambda t: "\n".join([t.split("\n")[0], *[t.split("\n")[1]] * 9])),
    "csv: quotes": csv(lambda t: t.replace(",", '","', 5)),
}
PICKLES: Mapping[str, Maker] = {
    "program": pickled(lambda: {"poses": Evil()}),
    "program of protocol 0": pickled(lambda: {"poses": Evil()}, protocol=0),
    "a list": pickled(lambda: [1, 2]),
    "an empty dictionary": pickled(dict),
    "keys of numbers": pickled(lambda: {1: 2, (3, 4): 5}),
    "arrays of objects": pickled(lambda: {"smpl_poses": np.array([Evil()], object)}),
    "deep lists": writes("a.pkl", b"\x80\x04" + b"](" * 50_000 + b"e" * 50_000 + b"."),
    "memo of 2^31": writes("a.pkl", b"\x80\x04]r\xff\xff\xff\x7f."),
    "bytes of 2^31": writes("a.pkl", b"\x80\x04B\xff\xff\xff\x7fxx."),
    "long of 2^31": writes("a.pkl", b"\x80\x04\x8b\xff\xff\xff\x7fxx."),
    "endless stack": writes("a.pkl", b"\x80\x04" + b"}" * 3_000_000 + b"."),
    "an image of 1e7 pixels": lambda here: _hybrik(here, width=1e7, height=1e7),
    "an image of no pixels": lambda here: _hybrik(here, width=0.0, height=0.0),
    "cut": lambda here: (here / "a.pkl").write_bytes((BASE / "aist.pkl").read_bytes()[:3000]),
    "poses of text": pickled(lambda: {"smpl_poses": "x", "smpl_trans": "y"}),
    "poses of one": pickled(lambda: {"smpl_poses": np.zeros((1, 72)), "smpl_trans": np.zeros((1, 3))}),
    "scaling 0": pickled(lambda: {"smpl_poses": np.zeros((9, 72)), "smpl_trans": np.zeros((9, 3)),
                                  "smpl_scaling": np.zeros(1)}),
    "trans nan": pickled(lambda: {"smpl_poses": np.zeros((9, 72)), "smpl_trans": np.zeros((9, 3)) * np.nan,
                                  "smpl_scaling": np.ones(1)}),
}  # fmt: skip


def _hybrik(here: Path, **sizes: float) -> None:
    content = res_pk()
    for name, size in sizes.items():
        content[name] = np.full_like(np.asarray(content[name], float), size)
    (here / "a.pkl").write_bytes(pickle.dumps(content))


def _member(here: Path, name: str) -> None:
    with zipfile.ZipFile(here / "a.npz", "w") as archive:
        sink = io.BytesIO()
        np.save(sink, np.zeros((3, 3)))
        archive.writestr(name, sink.getvalue())


def cases() -> Iterator[Case]:
    for name, make in NPZ.items():
        yield Case("motion", f"npz: {name}", ("import", "a.npz", *OUT), make)
    for name, make in TEXTS.items():
        yield Case("motion", name, ("import", f"a.{name[:3]}", *OUT), make)
    for name, make in PICKLES.items():
        yield Case("motion", f"pickle: {name}", ("import", "a.pkl", *OUT), make)
    for at in (0.01, 0.5, 0.9):
        yield Case(
            "motion", f"pt: cut at {at:.0%}", ("import", "gvhmr.pt", *OUT), damaged("gvhmr.pt", at)
        )
    for at in (0.05, 0.5):
        make = damaged("gvhmr.pt", at, flip=300)
        yield Case("motion", f"pt: bytes at {at:.0%}", ("import", "gvhmr.pt", *OUT), make)
    for start in (b"\x1f\x8b\x08", b"\x78\x9c", b"PAR1", b"%PDF-1.4", b"\xff\xd8\xff"):
        words = ("import", "a.bin", *OUT)
        yield Case("motion", f"beginning {start!r}", words, writes("a.bin", start + bytes(50)))
    yield Case("motion", "empty", ("import", "a.npz", *OUT), writes("a.npz", ""))
    yield Case("motion", "device", ("import", "/dev/zero", *OUT))
    yield Case("motion", "huge sparse file", ("import", "a.npz", *OUT), _sparse)
    yield Case("motion", "fps nan", ("import", "@/amass.npz", *OUT, "--fps", "nan"))
    yield Case("motion", "fps 0", ("import", "@/amass.npz", *OUT, "--fps", "0"))
    yield Case("motion", "up of HybrIK", ("import", "@/amass.npz", *OUT, "--up", "x"))


def _sparse(here: Path) -> None:
    with (here / "a.npz").open("wb") as file:
        file.truncate(50 * 2**30)
