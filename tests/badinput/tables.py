"""Our own Parquet tables with everything in them that can be wrong."""

import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tests.badinput.base import BASE
from tests.badinput.case import Case, Maker, writes

Change = Callable[[pa.Table], pa.Table]


def facts(**changes: object) -> Change:
    """Return the table with other facts in its metadata; `...` removes one."""

    def change(table: pa.Table) -> pa.Table:
        known = dict(table.schema.metadata)
        for name, value in changes.items():
            known.pop(name.encode(), None)
            if value is not ...:
                raw = value if isinstance(value, bytes) else json.dumps(value).encode()
                known[name.encode()] = raw
        return table.replace_schema_metadata(known)

    return change


def column(name: str, value: Callable[[np.ndarray], np.ndarray]) -> Change:
    """Return the table with another vector column."""

    def change(table: pa.Table) -> pa.Table:
        old = table.column(name).combine_chunks()
        width = old.type.list_size
        rows = value(old.flatten().to_numpy(zero_copy_only=False).reshape(-1, width).copy())
        made = pa.FixedSizeListArray.from_arrays(
            pa.array(rows.ravel(), old.type.value_type), rows.shape[1]
        )
        return table.set_column(table.column_names.index(name), name, made)

    return change


def scalar(name: str, values: object) -> Change:
    """Return the table with a plain column."""

    def change(table: pa.Table) -> pa.Table:
        return table.set_column(
            table.column_names.index(name), name, pa.array([values] * len(table))
        )

    return change


def reversed_(name: str) -> Change:
    """Return the table with the values of a column in the opposite order."""

    def change(table: pa.Table) -> pa.Table:
        index = table.column_names.index(name)
        values = table.column(name).to_pylist()[::-1]
        return table.set_column(index, name, pa.array(values, table.schema.field(name).type))

    return change


def entry(value: float) -> Callable[[np.ndarray], np.ndarray]:
    """Return a column with one number replaced."""

    def change(rows: np.ndarray) -> np.ndarray:
        rows[len(rows) // 2, 0] = value
        return rows

    return change


def rows(count: int) -> Change:
    """Return the table repeated to a number of rows."""

    def change(table: pa.Table) -> pa.Table:
        return table.take(pa.array(np.arange(count) % max(len(table), 1)))

    return change


NESTED = b"[" * 100_000 + b"]" * 100_000
SMPL: Mapping[str, Change] = {
    **{f"fps {v!r}": facts(fps=v) for v in (0, -30, "30", None, [30], True, 1e9, 1e-9)},
    "fps nan": facts(fps=b"NaN"),
    "fps 0.02": facts(fps=0.02),
    "fps infinite": facts(fps=b"Infinity"),
    "fps nested": facts(fps=NESTED),
    "no fps": facts(fps=...),
    "betas of text": facts(betas=["x"] * 10),
    "nine betas": facts(betas=[0.0] * 9),
    "betas of 1e30": facts(betas=[1e30] * 10),
    "rest joints missing": facts(rest_joints=[]),
    "rest joints flat": facts(rest_joints=[0.0] * 87),
    "rest joints huge": facts(rest_joints=[[1e30] * 3] * 29),
    "person negative": facts(person=-1),
    "person of text": facts(person="me"),
    "notes a number": facts(notes=3),
    "notes nested": facts(notes=[[["x"]]]),
    "camera a list": facts(camera=[1]),
    "camera of zero width": facts(camera={"width": 0, "height": 0, "focal_px": 0}),
    "another table": facts(table="ReferenceMotion"),
    "a table of nonsense": facts(table={"a": 1}),
    "no rows": rows(0),
    "one row": rows(1),
    "800000 rows": rows(800_000),
    "100000 rows": rows(100_000),
    **{f"joints {v:g}": column("joints", entry(v)) for v in (np.nan, np.inf, 1e30)},
    "orientation nan": column("global_orient", entry(np.nan)),
    "orientation 1e30": column("global_orient", entry(1e30)),
    "pose 1e30": column("body_pose", entry(1e30)),
    "transl 1e30": column("transl", entry(1e30)),
    "keypoints 1e9": column("keypoints_w", entry(1e9)),
    "all joints at one place": column("keypoints_w", np.zeros_like),
    "contact 7": column("contact", lambda a: np.full_like(a, 7)),
    "contact -1": column("contact", lambda a: np.full_like(a, -1)),
    "confidence nan": column("confidence", entry(np.nan)),
    "pose of 68 numbers": column("body_pose", lambda a: a[:, :68]),
    "pose as text": scalar("body_pose", "x"),
    "column missing": lambda t: t.drop_columns(["transl"]),
    "column twice": lambda t: t.append_column("transl", t.column("transl")),
    "column of another": lambda t: t.append_column("evil", pa.array([1] * len(t))),
    "valid as numbers": scalar("valid", 1.5),
    "valid nowhere": scalar("valid", False),
    "time stands": scalar("time_s", 0.0),
    "time goes back": reversed_("time_s"),
    "frames count down": reversed_("frame"),
    "nulls": lambda t: t.set_column(
        2, "global_orient", pa.array([None] * len(t), t.column("global_orient").type)
    ),
    "nested columns": lambda t: t.append_column("deep", pa.array([[[["x"]]]] * len(t))),
}
REFERENCE: Mapping[str, Change] = {
    **{f"dt {v!r}": facts(dt=v) for v in (0, -0.015, "x", None, 1e9, 1e-12)},
    "dt nan": facts(dt=b"NaN"),
    "dt nested": facts(dt=NESTED),
    "robot of text": facts(robot="nobody"),
    "robot a path": facts(robot="../../etc/passwd"),
    "robot a number": facts(robot=3),
    "robot file a device": facts(robot_file="/dev/zero"),
    "robot file missing": facts(robot_file="/nothing/robot.yaml"),
    "time goes back": reversed_("time_s"),
    "steps count down": reversed_("step"),
    "another model": facts(model_sha256="0" * 64),
    "model a number": facts(model_sha256=1),
    "joint names reversed": lambda t: facts(
        joint_names=json.loads(t.schema.metadata[b"joint_names"])[::-1]
    )(t),
    "joint names short": facts(joint_names=["a"]),
    "joint names double": lambda t: facts(
        joint_names=["x"] * len(json.loads(t.schema.metadata[b"joint_names"]))
    )(t),
    "joint names of numbers": facts(joint_names=[1, 2]),
    "body names reversed": lambda t: facts(
        body_names=json.loads(t.schema.metadata[b"body_names"])[::-1]
    )(t),
    "cyclic of text": facts(cyclic="yes"),
    "offset of two": facts(cycle_offset=[0.0, 0.0]),
    "offset 1e30": facts(cycle_offset=[1e30, 0.0, 0.0]),
    "scorecard a list": facts(scorecard=[]),
    "scorecard of text": facts(scorecard={"a": "x"}),
    "certificate a number": facts(certificate=3),
    "certificate of nonsense": facts(
        certificate={"findings": [{"a": 1}], "slack": [], "tempo": []}
    ),
    **{f"qpos {v:g}": column("qpos", entry(v)) for v in (np.nan, np.inf, 1e20)},
    "qvel 1e30": column("qvel", entry(1e30)),
    "quaternions zero": column(
        "qpos", lambda a: np.concatenate([a[:, :3], 0 * a[:, 3:7], a[:, 7:]], 1)
    ),
    "qpos narrow": column("qpos", lambda a: a[:, :-1]),
    "qvel narrow": column("qvel", lambda a: a[:, :-1]),
    "bodies narrow": column("body_pos_w", lambda a: a[:, :-3]),
    "contact 9": column("contact", lambda a: np.full_like(a, 9)),
    "contacts of three": column("contact", lambda a: np.repeat(a, 2, 1)[:, :3]),
    "torque nan": column("torque_ratio", entry(np.nan)),
    "no rows": rows(0),
    "one row": rows(1),
    "300000 rows": rows(300_000),
}


def changed(name: str, change: Change) -> Maker:
    """Return a maker of a base table with one thing wrong."""

    def make(here: Path) -> None:
        pq.write_table(change(pq.read_table(BASE / name)), here / name, compression="zstd")

    return make


def damaged(name: str, at: float, flip: int = 0) -> Maker:
    """Return a maker of a base file that is cut off, or in which bytes are overwritten."""

    def make(here: Path) -> None:
        data = bytearray((BASE / name).read_bytes())
        place = int(len(data) * at)
        if flip:
            data[place : place + flip] = np.random.default_rng(flip).bytes(flip)
        (here / name).write_bytes(data if flip else data[:place])

    return make


def _long_text(here: Path) -> None:
    """Write a few bytes that promise one long text for every row."""
    text = pa.array(["x" * 5_000_000]).dictionary_encode()
    many = pa.DictionaryArray.from_arrays(pa.array(np.zeros(200_000, np.int32)), text.dictionary)
    pq.write_table(pa.table({"run_id": many.cast(pa.dictionary(pa.int32(), pa.string()))}),
                   here / "smpl.parquet", store_schema=False)  # fmt: skip


def cases() -> Iterator[Case]:
    for name, change in SMPL.items():
        words = ("retarget", "smpl.parquet", "-o", "out")
        yield Case("table", f"smpl: {name}", words, changed("smpl.parquet", change))
    for number, (name, change) in enumerate(REFERENCE.items()):
        motion = "reference.parquet"
        words = (
            ("train", motion, "-o", "out", "--steps", "300"),
            ("evaluate", "@/policy.safetensors", motion),
            ("export", motion, "--to", "beyondmimic", "-o", "out.npz"),
        )[number % 2 if "row" in name or name.startswith(("bodies", "torque")) else number % 3]
        yield Case("table", f"reference: {name}", words, changed(motion, change))
    for at in (0.0, 0.2, 0.6, 0.95):
        words = ("retarget", "smpl.parquet", "-o", "out")
        yield Case("table", f"smpl: cut at {at:.0%}", words, damaged("smpl.parquet", at))
    for at in (0.001, 0.3, 0.9, 0.99):
        words = ("export", "smpl.parquet", "--to", "bvh", "-o", "out.bvh")
        made = damaged("smpl.parquet", at, flip=60)
        yield Case("table", f"smpl: bytes at {at:.1%}", words, made)
    yield Case(
        "table", "one long text in every row", ("retarget", "smpl.parquet", "-o", "out"), _long_text
    )
    yield Case(
        "table", "text as table", ("retarget", "a.parquet", "-o", "out"), writes("a.parquet", "x")
    )
    yield Case("table", "folder as table", ("retarget", ".", "-o", "out"))
    yield Case("table", "device as table", ("retarget", "/dev/zero", "-o", "out"))
    yield Case("table", "reference to retarget", ("retarget", "@/reference.parquet", "-o", "out"))
    yield Case("table", "smpl to train", ("train", "@/smpl.parquet", "-o", "out", "--steps", "9"))
