"""Questions in SQL, addresses of the web, stores, backups and everything else that is named."""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path

from tests.badinput.base import CLIP
from tests.badinput.case import Case, Maker, nothing, writes

SQL: Mapping[str, str] = {
    "two thousand million letters": "SELECT repeat('x', 2000000000)",
    "endless rows": "SELECT * FROM range(100000000)",
    "endless work": "SELECT count(*) FROM range(10000000) a, range(10000000) b",
    "endless list": "SELECT list(range) FROM range(400000000)",
    "endless recursion": "WITH RECURSIVE t AS (SELECT 1 a UNION ALL SELECT a+1 FROM t) SELECT * FROM t",
    "endless sort": "SELECT * FROM range(2000000000) ORDER BY random()",
    "a file": "SELECT * FROM read_csv('/etc/passwd')",
    "a text": "SELECT * FROM read_text('/etc/passwd')",
    "a glob": "SELECT * FROM glob('/etc/*')",
    "copy out": "COPY (SELECT 1) TO 'planted.csv'",
    "export": "EXPORT DATABASE 'planted'",
    "attach": "ATTACH 'planted.db'",
    "install": "INSTALL httpfs",
    "load": "LOAD 'evil.so'",
    "unlock": "SET enable_external_access = true",
    "more memory": "SET memory_limit = '100GB'",
    "no SQL": "hello",
    "unknown table": "SELECT * FROM evil",
    "unknown column": "SELECT evil FROM runs",
    "two names": "SELECT 1 AS a, 2 AS a",
    "quotes": "SELECT '",
    "a comment": "--",
    "control characters": "SELECT \x1b[31m",
    "parameters": "SELECT $evil",
    "division of text": "SELECT 'a'::INTEGER",
    "shell": ".shell touch planted",
}
BOTH = ("endless rows", "a file")
"""Of both commands; the others share their limits."""
ADDRESSES = (
    "ftp://127.0.0.1/x.mp4", "file:///etc/passwd", "javascript:alert(1)", "data:video/mp4;base64,AA",
    "gopher://127.0.0.1/", "http://", "http://[::1", "//127.0.0.1/x", "http:127.0.0.1",
)  # fmt: skip


def _backup(here: Path) -> None:
    (here / "b").mkdir()
    (here / "b" / "evil.json").write_text("{")


def _pipe(name: str) -> Maker:
    def make(here: Path) -> None:
        (here / name).parent.mkdir(parents=True, exist_ok=True)
        os.mkfifo(here / name)

    return make


def _fake(content: str) -> Maker:
    def make(here: Path) -> None:
        folder = here / "b" / "backups"
        folder.mkdir(parents=True)
        (folder / "20260101T000000.json").write_text(content)

    return make


def cases() -> Iterator[Case]:
    for name, sql in SQL.items():
        for command in ("metrics", "catalogue") if name in BOTH else ("metrics",):
            yield Case("question", f"{command}: {name}", (command, "--sql", sql))
    for address in ADDRESSES:
        yield Case("address", f"urls {address}", ("find", "x", "--source", "urls", "--address", "l.txt"),
                   writes("l.txt", address))  # fmt: skip
        yield Case(
            "address",
            f"server {address}",
            ("find", "x", "--source", "server", "--address", address),
        )
    for name, content in {"empty": "", "binary": b"\xff\xfe\0", "comments": "# a\n# b\n"}.items():
        words = ("find", "x", "--source", "urls", "--address", "l.txt")
        yield Case("address", f"list {name}", words, writes("l.txt", content))
    for name, path in {"device": "/dev/zero", "folder": "/tmp", "missing": "no.txt"}.items():
        yield Case(
            "address", f"list is a {name}", ("find", "x", "--source", "urls", "--address", path)
        )
    for name, words in {
        "unknown source": ("find", "x", "--source", "evil"),
        "source of a text": ("find", "x", "--source", "evil.py"),
        "folder missing": ("find", "nothing", "--source", "folder"),
        "folder empty": ("find", ".", "--source", "folder"),
        "site without address": ("find", "x", "--source", "site"),
        "empty query": ("find", "   "),
        "top 0": ("find", "x", "--top", "0"),
        "refresh unknown": ("refresh", "evil"),
    }.items():
        yield Case("address", name, words)
    for name, (words, make) in {
        "no backup": (("restore", "b"), nothing),
        "damaged backup": (("restore", "b"), _backup),
        "backup of nonsense": (("restore", "b"), _fake("{}")),
        "backup nested": (("restore", "b"), _fake("[" * 100_000)),
        "backup at a path": (("restore", "b", "--at", "../../etc/passwd"), _backup),
        "backup into a file": (("backup", "f"), writes("f", "")),
        "backup keeps 0": (("backup", "b", "--keep", "0"), nothing),
        "study unknown": (("ablation", "evil"), nothing),
        "study a device": (("ablation", "/dev/zero"), nothing),
        "study damaged": (("ablation", "s.yaml"), writes("s.yaml", "moves: {")),
        "study unknown key": (("ablation", "s.yaml"), writes("s.yaml", "evil: 1")),
        "clean of no store": (("clean",), nothing),
        "clean negative": (("clean", "--older-than", "-1"), nothing),
        "clean unknown": (("clean", "--kind", "evil"), nothing),
        "port 0": (("server", "--port", "0"), nothing),
        "port of text": (("server", "--port", "x"), nothing),
        "dance of a name of 2000": (("dance", "x" * 2000), nothing),
        "dance empty": (("dance", ""), nothing),
        "dance of an end before its start": (
            ("dance", str(CLIP), "--start", "3", "--end", "1"),
            nothing,
        ),
        "dance beyond the end": (("dance", str(CLIP), "--start", "99"), nothing),
        "dance start nan": (("dance", str(CLIP), "--start", "nan"), nothing),
        "dance minutes 0": (("dance", str(CLIP), "--minutes", "0"), nothing),
        "dance person 99": (("mocap", str(CLIP), "-o", "out", "--person", "99"), nothing),
        "view a film as a folder": (("view", str(CLIP), "--to", "gif", "-o", "."), nothing),
        "view a film as a pipe": (("view", str(CLIP), "--to", "gif", "-o", "p"), _pipe("p")),
        "view a text as gif": (("view", "a.mp4", "--to", "gif", "-o", "x"), writes("a.mp4", "x")),
        "view a folder of nothing": (("view", ".", "--to", "gltf", "-o", "x.glb"), nothing),
        "perform for ever": (
            ("perform", "@/reference.parquet", "-o", "o", "--seconds", "inf"),
            nothing,
        ),
        "clean older than for ever": (("clean", "--older-than", "inf"), nothing),
        "backup of nothing": (("backup", "b"), nothing),
        "restore a manifest that is a pipe": (("restore", "b"), _pipe("b/backups/2026.json")),
        "licences into a folder": (("licences", "--sbom", "."), nothing),
        "dance for ever": (("dance", str(CLIP), "--minutes", "inf"), nothing),
        "pretrain a person": (("pretrain", "-o", "w", "--reference", "@/smpl.parquet"), nothing),
        "pretrain nothing": (("pretrain", "-o", "f", "--steps", "0"), nothing),
    }.items():
        yield Case("command", name, words, make)
