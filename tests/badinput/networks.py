"""Weights and policies: programs in pickles, damaged files, other networks, numbers that are none."""

import io
import json
import pickle
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import safe_open
from safetensors.numpy import save_file

from tests.badinput.base import BASE, CLIP
from tests.badinput.case import Case, Maker, writes
from tests.badinput.motion_files import Evil
from tests.badinput.tables import NESTED, damaged

FORMAT = "robojackson-policy-1"
Tensors = dict[str, np.ndarray]


def policy(
    tensors: Callable[[Tensors], Tensors] = lambda t: t,
    facts: Callable[[dict[str, Any]], Any] = lambda f: f,
    raw: str | None = None,
) -> Maker:
    """Return a maker of a policy with other tensors or facts."""

    def make(here: Path) -> None:
        with safe_open(BASE / "policy.safetensors", framework="np") as file:
            known = json.loads(file.metadata()[FORMAT])
            found = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        header = raw if raw is not None else json.dumps(facts(known))
        save_file(tensors(found), here / "p.safetensors", {FORMAT: header})

    return make


def _nan(tensors: Tensors) -> Tensors:
    tensors["layer0.weight"] = tensors["layer0.weight"] * np.nan
    return tensors


POLICIES: Mapping[str, Maker] = {
    "weights nan": policy(_nan),
    "weights 1e38": policy(lambda t: {n: np.full_like(a, 3e38) for n, a in t.items()}),
    "a layer missing": policy(lambda t: {n: a for n, a in t.items() if "layer1" not in n}),
    "a tensor more": policy(lambda t: {**t, "evil": np.zeros(3)}),
    "flat weights": policy(lambda t: {n: a.ravel() for n, a in t.items()}),
    "no tensors": policy(lambda t: {}),
    "layers misfit": policy(lambda t: {**t, "layer0.weight": t["layer0.weight"][:, :-1].copy()}),
    "observation of three": policy(lambda t: {**t, "layer0.weight": t["layer0.weight"][:3].copy()}),
    "weights of integers": policy(lambda t: {n: a.astype(np.int64) for n, a in t.items()}),
    "facts nested": policy(raw=NESTED.decode()),
    "facts a list": policy(facts=lambda f: [1]),
    "facts empty": policy(facts=lambda f: {}),
    "facts no JSON": policy(raw="{"),
    "robot unknown": policy(facts=lambda f: {**f, "robot": "nobody"}),
    "robot a number": policy(facts=lambda f: {**f, "robot": 7}),
    "mode unknown": policy(facts=lambda f: {**f, "mode": "evil"}),
    "environment of text": policy(facts=lambda f: {**f, "environment": "x"}),
    "environment unknown keys": policy(facts=lambda f: {**f, "environment": {"evil": 1}}),
    "control missing": policy(facts=lambda f: {k: v for k, v in f.items() if k != "control"}),
    "control nan": policy(raw='{"control": {"substeps": NaN}, "robot": "humanoid"}'),
    "text": writes("p.safetensors", "text"),
    "empty": writes("p.safetensors", ""),
    "header of 2^60": writes("p.safetensors", (2**60).to_bytes(8, "little") + b"{}"),
    "header of overlap": writes(
        "p.safetensors",
        (80).to_bytes(8, "little")
        + b'{"a":{"dtype":"F32","shape":[9999999999],"data_offsets":[0,4]}}'.ljust(80)
        + bytes(4),
    ),
    "cut": damaged("policy.safetensors", 0.5),
    "bytes": damaged("policy.safetensors", 0.001, flip=200),
}


def _sb3(data: object, weights: bytes) -> Maker:
    def make(here: Path) -> None:
        with zipfile.ZipFile(here / "p.zip", "w") as archive:
            archive.writestr("data", data if isinstance(data, str) else json.dumps(data))
            archive.writestr("policy.pth", weights)

    return make


def _torch(content: Callable[[], object], name: str = "w.pt") -> Maker:
    def make(here: Path) -> None:
        import torch

        torch.save(content(), here / name)

    return make


def _pth(content: Callable[[], object]) -> bytes:
    import torch

    sink = io.BytesIO()
    torch.save(content(), sink)
    return sink.getvalue()


WEIGHTS: Mapping[str, Maker] = {
    "program": _torch(lambda: {"a": Evil()}),
    "bare pickle of a program": lambda here: (here / "w.pt").write_bytes(pickle.dumps(Evil())),
    "text": writes("w.pt", "text"),
    "empty": writes("w.pt", ""),
    "a list": _torch(lambda: [1, 2, 3]),
    "no known network": _torch(lambda: {}),
    "zip of nothing": lambda here: zipfile.ZipFile(here / "w.pt", "w").close(),
    "device": lambda here: (here / "w.pt").symlink_to("/dev/zero"),
    "folder": lambda here: (here / "w.pt").mkdir(),
}
STARTS: Mapping[str, tuple[str, Maker]] = {
    "sb3 of a program": ("p.zip", lambda here: _sb3({}, pickle.dumps(Evil()))(here)),
    "sb3 of a program in torch's file": (
        "p.zip",
        lambda here: _sb3({}, _pth(lambda: Evil()))(here),
    ),
    "sb3 of nothing": ("p.zip", _sb3({}, b"")),
    "sb3 with nested data": ("p.zip", _sb3(NESTED.decode(), b"")),
    "sb3 of another algorithm": ("p.zip", lambda here: _sb3({}, _pth(dict))(here)),
    "networks of text": ("networks.safetensors", writes("networks.safetensors", "text")),
    "networks cut": ("networks.safetensors", damaged("networks.safetensors", 0.3)),
}


def cases() -> Iterator[Case]:
    for number, (name, make) in enumerate(POLICIES.items()):
        words: tuple[str, ...] = ("evaluate", "p.safetensors", "@/reference.parquet")
        if number % 3 == 1 and name.startswith(
            ("weights", "a ", "flat", "no ", "layers", "facts n")
        ):
            words = ("export", "p.safetensors", "--to", "onnx", "-o", "p.onnx")
        yield Case("network", f"policy: {name}", words, make)
    for name, make in WEIGHTS.items():
        words = ("mocap", str(CLIP), "-o", "out", "--hybrik", "w.pt")
        yield Case("network", f"hybrik: {name}", words, make)
    yield Case("network", "niki alone", ("mocap", str(CLIP), "-o", "out", "--niki", "w.pt"),
               writes("w.pt", "text"))  # fmt: skip
    for name, (file, make) in STARTS.items():
        words = ("train", "@/reference.parquet", "-o", "out", "--steps", "300")
        yield Case("network", f"start: {name}", (*words, "--set", f"start={file}"), make)
    yield Case("network", "start: a name of the hub", ("train", "@/reference.parquet", "-o", "out",
               "--set", "start=../x"))  # fmt: skip
    yield Case("network", "tracker not the pinned file",
               ("trackers", "add", "twist2", "--file", "w.onnx"), writes("w.onnx", "text"))  # fmt: skip
    yield Case("network", "deploy without facts", ("export", "p.safetensors", "--to", "deploy", "-o", "out"),
               POLICIES["facts empty"])  # fmt: skip
