"""The locks have a digest a package, and licences and bill of materials name all of them."""

import json
import re
from importlib.metadata import PathDistribution
from pathlib import Path

import pytest

from robojackson.pipeline import licences
from tools.assets.lock import APART, PYTHONS

ROOT = Path(__file__).parents[2]
PINNED = re.compile(r"^([a-z0-9._-]+)(?:\[[^\]]*\])?==(\S+)", re.MULTILINE)


@pytest.mark.parametrize("python", PYTHONS)
def test_every_pin_of_a_lock_has_a_digest(python: str) -> None:
    text = (ROOT / "locks" / f"py{python.replace('.', '')}.txt").read_text()
    blocks = re.split(r"\n(?=[a-z])", text)[1:]
    assert len(blocks) > 150
    assert [b.split()[0] for b in blocks if "--hash=sha256:" not in b] == []
    assert [b.split()[0] for b in blocks if APART.match(b)] == []


@pytest.mark.parametrize("python", PYTHONS)
def test_a_lock_pins_what_the_constraints_say(python: str) -> None:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    result = dict(PINNED.findall("\n".join(line for line in lines if ";" not in line)))
    locked = dict(PINNED.findall((ROOT / "locks" / f"py{python.replace('.', '')}.txt").read_text()))
    apart = {n: (v, result[n]) for n, v in locked.items() if n in result and result[n] != v}
    assert apart == {}


def test_every_package_has_a_licence_and_stands_in_the_bill(tmp_path: Path) -> None:
    rows = licences.packages()
    names = {row["package"] for row in rows}
    assert {"robojackson", "mujoco", "torch", "mediapipe", "av"} <= names
    assert [row["package"] for row in rows if row["licence"] == licences.UNKNOWN] == []
    licences.write_sbom(tmp_path / "a.json", rows)
    licences.write_sbom(tmp_path / "b.json", rows)
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    bill = json.loads((tmp_path / "a.json").read_text())
    assert {part["name"] for part in bill["components"] if part["type"] == "library"} == names


@pytest.mark.parametrize(
    ("name", "result"),
    [("cuda-toolkit", "NVIDIA CUDA Toolkit EULA"), ("stranger", licences.UNKNOWN)],
)
def test_a_licence_that_no_metadata_states(name: str, result: str, tmp_path: Path) -> None:
    (tmp_path / "METADATA").write_text(f"Metadata-Version: 2.4\nName: {name}\nVersion: 1.0\n")
    assert licences.licence_of(PathDistribution(tmp_path)) == result


def test_the_data_that_ships_has_a_licence() -> None:
    result = " ".join(row["data"] for row in licences.data())
    table = (ROOT / "THIRD_PARTY.md").read_text().split("| files |")[1].split("\n\n")[0]
    for name in re.findall(r"`[\w/]*?(\w+)\*?[^`]*`", table):
        assert name.rstrip("_") in result or name in result, name
