"""The locks have a digest a package, and licences and bill of materials name all of them."""

import json
import re
import tomllib
from importlib.metadata import PathDistribution
from pathlib import Path

import pytest

from robojackson.pipeline import licences
from tools.assets.lock import APART, EXTRAS, PYTHONS

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
PINNED = re.compile(r"^([A-Za-z0-9._-]+)(?:\[[^\]]*\])?==(\S+)", re.MULTILINE)


def pins(text: str) -> dict[str, str]:
    """Return the pinned versions by names in the form of the index: SQLAlchemy is sqlalchemy."""
    return {named(name): version for name, version in PINNED.findall(text)}


def named(name: str) -> str:
    return re.sub("[-_.]+", "-", name).lower()


def locked(python: str) -> str:
    return (ROOT / "locks" / f"py{python.replace('.', '')}.txt").read_text()


@pytest.mark.parametrize("python", PYTHONS)
def test_every_pin_of_a_lock_has_a_digest(python: str) -> None:
    blocks = re.split(r"\n(?=[A-Za-z])", locked(python))[1:]
    assert len(blocks) > 150
    assert [b.split()[0] for b in blocks if "--hash=sha256:" not in b] == []
    assert [b.split()[0] for b in blocks if APART.match(b)] == []


@pytest.mark.parametrize("python", PYTHONS)
def test_a_lock_pins_what_the_constraints_say(python: str) -> None:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    result = pins("\n".join(line for line in lines if ";" not in line))
    found = pins(locked(python))
    both = found.keys() & result.keys()
    assert len(both) > 0.9 * len(found)
    assert {n: (found[n], result[n]) for n in both if found[n] != result[n]} == {}


@pytest.mark.parametrize("python", PYTHONS)
def test_a_lock_has_everything_that_the_package_and_its_extras_name(python: str) -> None:
    required = [PROJECT["dependencies"], *(PROJECT["optional-dependencies"][e] for e in EXTRAS)]
    names = {named(re.split(r"[\[<>=!~; ]", line)[0]) for lines in required for line in lines}
    assert {"sqlalchemy", "jinja2", "onnxruntime", "s3fs"} <= names
    apart = {name for name in names if APART.match(name)}
    assert apart == {"torch"}
    assert names - apart - pins(locked(python)).keys() == set()


def test_names_are_compared_as_the_index_does() -> None:
    assert pins("SQLAlchemy==2.0\nruamel.yaml==1\ntyping_extensions[a]==4\n") == {
        "sqlalchemy": "2.0",
        "ruamel-yaml": "1",
        "typing-extensions": "4",
    }


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
