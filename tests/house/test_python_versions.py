"""The pins install on the Pythons that users have, of Debian 12 and 13 and of Ubuntu 24.04."""

import re
import tomllib
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path

import pytest
from packaging.specifiers import SpecifierSet

ROOT = Path(__file__).parents[2]
OF_A_SYSTEM = {"Debian 12": "3.11.2", "Ubuntu 24.04": "3.12.3", "Debian 13": "3.13.5"}
PINNED = re.findall(r"(?m)^([\w.-]+)==([^\s;]+)\s*$", (ROOT / "constraints.txt").read_text())


def required_python(name: str, version: str) -> str | None:
    """Return the Python that a pinned package requires; None where it is not installed in this
    version."""
    try:
        found = metadata(name)
    except PackageNotFoundError:
        return None
    same = found["Version"].partition("+")[0] == version
    return str(found.get("Requires-Python") or "") if same else None


@pytest.mark.parametrize("system", OF_A_SYSTEM)
def test_no_pin_refuses_the_python_of_a_system(system: str) -> None:
    required = {name: required_python(name, version) for name, version in PINNED}
    known = {name: text for name, text in required.items() if text is not None}
    assert len(known) > 200
    refused = {n: t for n, t in known.items() if OF_A_SYSTEM[system] not in SpecifierSet(t)}
    assert refused == {}


def test_classifiers_bootstrap_and_requires_python_name_the_same_versions() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    minors = re.findall(r"Python :: 3\.(\d+)", " ".join(project["classifiers"]))
    versions = SpecifierSet(project["requires-python"])
    assert minors == [str(minor) for minor in range(30) if f"3.{minor}.0" in versions]
    text = (ROOT / "tools" / "bootstrap.sh").read_text()
    assert f"'(3, {minors[0]}) <= sys.version_info[:2] <= (3, {minors[-1]})'" in text
    assert f"for minor in {' '.join(minors)}; do" in text
