"""Odd inputs that are valid: names, containers, rates, encodings and values that must succeed."""

import os
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tests.badinput.base import BASE, CLIP
from tests.badinput.case import Case, Maker, nothing
from tests.badinput.motion_files import amass, bvh, csv
from tests.badinput.robot_files import MODEL, SHIPPED, YAML, robot
from tests.badinput.tables import changed, facts

NAMES = (
    "Dance: hip.mp4", "12:30.mp4", "data:x.mp4", "concat:a|b.mp4", "file:x.mp4", "%d.mp4",
    "a b.mp4", "Tänzerin.mp4", "舞.mp4", "$HOME.mp4", "`id`.mp4", "-x.mp4", "a'b\"c.mp4", "no suffix",
    "x.MP4", "x.m3u8", "a?b*.mp4", "..mp4", "[bold]x.mp4", "\x1b[31mred\x07.mp4", "\u202egpj.mp4",
    "x" * 200 + ".mp4", "💃.mp4", "a\nb.mp4", "http:x.mp4",
)  # fmt: skip
CONTAINERS = {
    "matroska": "mkv",
    "avi": "avi",
    "mpegts": "ts",
    "mov": "mov",
    "nut": "nut",
    "flv": "flv",
}


def _copy(name: str) -> Maker:
    return lambda here: shutil.copy(CLIP, here / name)


def _remuxed(suffix: str, *options: str) -> Maker:
    def make(here: Path) -> None:
        import imageio_ffmpeg

        command = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(CLIP), *options]
        subprocess.run([*command, f"a.{suffix}"], cwd=here, check=True)

    return make


def _bytes(here: Path) -> None:
    shutil.copy(CLIP, os.fsencode(here) + b"/\xff\xfe.mp4")


def _reordered(table: pa.Table) -> pa.Table:
    return table.select(table.column_names[::-1])


def _own(here: Path) -> None:
    (here / "mine.yaml").write_text("\ufeff" + YAML.replace(SHIPPED, "mine.xml"))
    shutil.copy(MODEL, here / "mine.xml")


def _config(text: str) -> Maker:
    return lambda here: (here / "c.yaml").write_text(text)


LIGHT: Mapping[str, tuple[tuple[str, ...], Maker]] = {
    "amass of 66": (("import", "a.npz", "-o", "o"), amass(poses=lambda a: a["poses"][:, :66])),
    "amass of 72": (("import", "a.npz", "-o", "o"), amass(poses=lambda a: a["poses"][:, :72])),
    "amass of float16": (("import", "a.npz", "-o", "o"),
                         amass(poses=lambda a: a["poses"].astype(np.float16))),
    "amass in columns": (("import", "a.npz", "-o", "o"),
                         amass(poses=lambda a: np.asfortranarray(a["poses"]))),
    "amass big endian": (("import", "a.npz", "-o", "o"), amass(poses=lambda a: a["poses"].astype(">f8"))),
    "amass without rate": (("import", "a.npz", "-o", "o", "--fps", "30"), amass(mocap_framerate=...)),
    "amass with objects beside": (("import", "a.npz", "-o", "o"),
                                  amass(labels=np.array([{"a": 1}], object))),
    "amass of two frames": (("import", "a.npz", "-o", "o"),
                            amass(poses=lambda a: a["poses"][:2], trans=lambda a: a["trans"][:2])),
    "bvh with a mark": (("import", "a.bvh", "-o", "o"), bvh(lambda t: "\ufeff" + t)),
    "bvh with CRLF": (("import", "a.bvh", "-o", "o"), bvh(lambda t: t.replace("\n", "\r\n"))),
    "bvh on one line": (("import", "a.bvh", "-o", "o"), bvh(lambda t: t.replace("\n", " "))),
    "csv with CRLF": (("import", "a.csv", "-o", "o"), csv(lambda t: t.replace("\n", "\r\n"))),
    "csv with a mark": (("import", "a.csv", "-o", "o"), csv(lambda t: "\ufeff" + t)),
    "another suffix": (("import", "a.txt", "-o", "o"),
                       lambda here: shutil.copy(BASE / "motion.bvh", here / "a.txt")),
    "aist": (("import", "@/aist.pkl", "-o", "o"), nothing),
    "gvhmr": (("import", "@/gvhmr.pt", "-o", "o"), nothing),
    "columns in another order": (("export", "smpl.parquet", "--to", "bvh", "-o", "o.bvh"),
                                 changed("smpl.parquet", _reordered)),
    "facts more": (("export", "smpl.parquet", "--to", "bvh", "-o", "o.bvh"),
                   changed("smpl.parquet", facts(mine={"a": [1]}))),
    "fps 29.97": (("export", "smpl.parquet", "--to", "csv", "-o", "o.csv"),
                  changed("smpl.parquet", facts(fps=29.97))),
    "fps a whole number": (("export", "smpl.parquet", "--to", "csv", "-o", "o.csv"),
                           changed("smpl.parquet", facts(fps=30))),
    "not compressed": (("export", "smpl.parquet", "--to", "amass", "-o", "o.npz"),
                       lambda here: pq.write_table(pq.read_table(BASE / "smpl.parquet"),
                                                   here / "smpl.parquet", compression="none")),
    "many row groups": (("export", "smpl.parquet", "--to", "amass", "-o", "o.npz"),
                        lambda here: pq.write_table(pq.read_table(BASE / "smpl.parquet"),
                                                    here / "smpl.parquet", row_group_size=7)),
    "link to a table": (("export", "l.parquet", "--to", "amass", "-o", "o.npz"),
                        lambda here: (here / "l.parquet").symlink_to(BASE / "smpl.parquet")),
    "own robot with a mark": (("robots", "check", "mine.yaml", "-o", "o.png"), _own),
    "robot with merges": (("robots", "check", "mine.yaml", "-o", "o.png"),
                          robot(lambda t: t.replace("left_knee: -0.3", "left_knee: &k -0.3")
                                .replace("right_knee: -0.3", "right_knee: *k"))),
    "robots": (("robots",), nothing),
    "trackers": (("trackers",), nothing),
    "metrics": (("metrics", "--sql", "SELECT 1 AS \"a b\", 'x' AS \"\x1b[31m\""), nothing),
    "metrics of values": (("metrics", "--sql", "VALUES (1, 'a'), (2, NULL)"), nothing),
    "catalogue": (("catalogue",), nothing),
    "version": (("--version",), nothing),
    "help": (("mocap", "--help"), nothing),
}  # fmt: skip


def cases() -> Iterator[Case]:
    for number, name in enumerate(NAMES):
        words = ("score", "./" + name) if number % 4 else ("mocap", "./" + name, "-o", "out")
        yield Case("valid", f"called {name[:30]!r}", words, _copy(name), valid=True)
    for container, suffix in CONTAINERS.items():
        options = ("-c", "copy") if suffix in ("mkv", "mov", "nut") else ("-t", "1.5")
        yield Case(
            "valid",
            f"in {container}",
            ("score", f"a.{suffix}"),
            _remuxed(suffix, *options),
            valid=True,
        )
    for name, (words, make) in LIGHT.items():
        yield Case("valid", name, words, make, valid=True)
    for name, variables in {"MUJOCO_GL empty": {"MUJOCO_GL": ""}, "backend of matplotlib": {"MPLBACKEND": "junk"},
                            "a narrow terminal": {"COLUMNS": "1"}, "no terminal": {"TERM": "junk"},
                            "C locale": {"LC_ALL": "C", "LANG": "C"}}.items():  # fmt: skip
        yield Case(
            "valid", name, ("retarget", "@/smpl.parquet", "-o", "out"), env=variables, valid=True
        )
