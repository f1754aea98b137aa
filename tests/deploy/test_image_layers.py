"""What the image is built of in which order, and `bootstrap.sh` with stand-ins for its programs."""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tools.stack.service import ROOT

FILES = ("tools/bootstrap.sh", "pyproject.toml", "constraints.txt")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
PYTHON = f"""#!/bin/sh
[ "$1" = -m ] && {{ echo "$@" >>pip.log; exit 0; }}
[ "$2" = "import pip" ] && exit $PIP
exec {sys.executable} "$@"
"""
"""A Python whose pip writes down what it would install, or that has none."""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Return a folder of what the dependencies depend on, with an environment."""
    for name in FILES:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    python = tmp_path / ".venv" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text(PYTHON)
    python.chmod(0o755)
    return tmp_path


def bootstrap(project: Path, word: str, **given: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHON": "", "PIP": "0", **given}
    return subprocess.run(
        ["sh", "tools/bootstrap.sh", word], cwd=project, env=environment, capture_output=True,
        text=True, check=False, timeout=60,
    )  # fmt: skip


def test_a_changed_module_installs_no_dependency_again() -> None:
    words = [line.split() for line in (ROOT / "Dockerfile").read_text().splitlines() if line]
    copied = [[w for w in line[1:-1] if w[:2] != "--"] for line in words if line[0] == "COPY"]
    *before, last = copied
    assert last == ["."]
    assert {name for names in before for name in names} == set(FILES)
    starts = [" ".join(line) for line in words]
    installs = next(n for n, text in enumerate(starts) if "bootstrap.sh dependencies" in text)
    assert installs < starts.index("COPY --chown=jackson:jackson . .")
    assert "--no-deps --editable ." in starts[starts.index("COPY --chown=jackson:jackson . .") + 1]


def test_the_dependencies_are_read_without_the_package(project: Path) -> None:
    done = bootstrap(project, "dependencies", EXTRAS="app,s3")
    assert done.returncode == 0, done.stderr
    extras = PROJECT["optional-dependencies"]
    written = (project / ".venv" / "requirements.txt").read_text().splitlines()
    assert written == [*PROJECT["dependencies"], *extras["app"], *extras["s3"]]
    runs = (project / "pip.log").read_text().splitlines()
    assert [run for run in runs if "--constraint constraints.txt --requirement" in run] == [runs[1]]
    assert not any("--editable" in run for run in runs)


def test_a_checkout_is_installed_with_its_extras_once(project: Path) -> None:
    assert bootstrap(project, "install").returncode == 0
    log = project / "pip.log"
    assert "--editable .[app,fast,s3,dev]" in log.read_text()
    before = log.read_text()
    assert bootstrap(project, "install").returncode == 0
    assert log.read_text() == before


def test_an_environment_that_was_interrupted_is_created_again(project: Path) -> None:
    """Python's own `venv` brings pip last; `df` is replaced by one whose disk is full, so that
    nothing is created here."""
    programs = project / "bin"
    programs.mkdir()
    (programs / "df").write_text("#!/bin/sh\necho Header\necho disk 9 9 0 99% /\n")
    (programs / "df").chmod(0o755)
    done = bootstrap(project, "install", PIP="1", PATH=f"{programs}:{os.environ['PATH']}")
    assert done.returncode == 1
    assert "0 GB are free here" in done.stderr
    assert not (project / "pip.log").exists()
