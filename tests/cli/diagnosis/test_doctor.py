"""`robojackson doctor` reports whether the Python that it runs on is supported."""

import sys
import tomllib
from pathlib import Path

import pytest

from robojackson.cli.diagnosis import doctor
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


@pytest.mark.parametrize(
    ("checkout", "needed", "extra"),
    [
        (True, "run `make` again", ".venv/bin/pip install -e '.[dask]'"),
        (False, "pip install 'robojackson[app,fast]'", "pip install 'robojackson[dask]'"),
    ],
)
def test_what_is_missing_is_installed_where_the_program_is(
    checkout: bool, needed: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "is_checkout", lambda: checkout)
    monkeypatch.setattr(doctor, "installed", lambda name: None)
    found = examine()
    assert f"prefect: {needed}" in found["missing"]
    assert f"prefect-dask: {extra}" in found["optional"]


@pytest.mark.parametrize(
    ("requires", "named"),
    [(["numpy", "nvidia-cublas==13; platform_system == 'Linux'"], True), (["numpy"], False)],
)
def test_a_torch_for_cuda_is_named_with_what_makes_it_small(
    requires: list[str], named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "requires", lambda name: requires)
    lines = [line for line in examine()["optional"] if line.startswith("torch is its build")]
    assert [("TORCH_INDEX" in line, "make clean" in line) for line in lines] == [
        (True, True)
    ] * named


def test_the_versions_are_those_of_the_project() -> None:
    listed = {c.rpartition(" :: ")[2] for c in PROJECT["classifiers"] if "Python :: 3." in c}
    assert listed == {f"{major}.{minor}" for major, minor in PYTHONS}
    assert PROJECT["requires-python"] == ">=3.11,<3.14"
