"""`robojackson doctor` reports whether the Python that it runs on is supported."""

import sys
import tomllib
from pathlib import Path

import pytest

from robojackson.cli.diagnosis.doctor import PYTHONS, doctor_lines, examine, unsupported

PROJECT = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text())["project"]


@pytest.mark.parametrize("version", PYTHONS)
def test_a_supported_python_needs_no_line(version: tuple[int, int]) -> None:
    assert unsupported(version) == []


@pytest.mark.parametrize("version", [(3, 10), (3, 14)])
def test_another_python_is_named_with_those_supported(version: tuple[int, int]) -> None:
    (line,) = unsupported(version)
    assert line.startswith(f"Python {version[0]}.{version[1]} is not supported")
    assert "3.11, 3.12, 3.13" in line
    assert "make setup PYTHON=" in line


def test_the_python_of_the_tests_is_supported() -> None:
    answer = examine()
    assert (answer["python"], answer["python_supported"]) == (sys.version.split()[0], True)


def test_a_person_reads_each_missing_thing_on_a_line_and_a_verdict() -> None:
    found = {"ok": False, "missing": ["torch: run `make` again"], "optional": ["a, or b", "c"]}
    assert doctor_lines(found) == [
        "ok  False",
        "missing   torch: run `make` again",
        "optional  a, or b",
        "optional  c",
        "1 required item is missing.",
    ]
    result = doctor_lines({"ok": True, "missing": [], "optional": []})
    assert result[-2:] == ["Everything required is installed.", "next: robojackson dance"]


def test_the_versions_are_those_of_the_project() -> None:
    listed = {c.rpartition(" :: ")[2] for c in PROJECT["classifiers"] if "Python :: 3." in c}
    assert listed == {f"{major}.{minor}" for major, minor in PYTHONS}
    assert PROJECT["requires-python"] == ">=3.11,<3.14"
