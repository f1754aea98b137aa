"""What `make` runs first, before anything of ours is installed."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("free_gb", [0, 5])
def test_a_full_disk_is_refused_in_one_line_before_any_work(tmp_path: Path, free_gb: int) -> None:
    """`df` is replaced by one that says how much is free."""
    project, programs = tmp_path / "project", tmp_path / "bin"
    (project / "tools").mkdir(parents=True)
    for name in ("tools/bootstrap.sh", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, project / name)
    programs.mkdir()
    (programs / "df").write_text(
        f"#!/bin/sh\necho Header\necho disk 9 9 {free_gb * 1048576 + 1000} 99% /\n"
    )
    (programs / "df").chmod(0o755)
    done = subprocess.run(
        ["sh", "tools/bootstrap.sh", "install"],
        cwd=project,
        env={**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert f"and {free_gb} GB are free here" in done.stderr
    assert not (project / ".venv").exists()


def test_the_path_of_an_interpreter_may_have_spaces(tmp_path: Path) -> None:
    """It can make no environment, which shows that it is the one that was looked at."""
    python = tmp_path / "my python" / "python3"
    python.parent.mkdir()
    python.write_text(
        f'#!/bin/sh\ncase "$2" in *ensurepip*) exit 1 ;; esac\nexec {sys.executable} "$@"\n'
    )
    python.chmod(0o755)
    done = subprocess.run(
        ["sh", "tools/bootstrap.sh", "missing"],
        cwd=ROOT,
        env={**os.environ, "PYTHON": str(python)},
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    version = "{}.{}".format(*sys.version_info)
    assert f"python{version}-venv" in done.stdout.split()


@pytest.mark.parametrize(("index", "named"), [("", True), ("https://host/cpu", False)])
def test_the_size_of_torch_is_named_before_it_is_installed(
    tmp_path: Path, index: str, named: bool
) -> None:
    """pip is replaced by one that fails."""
    project = tmp_path / "project"
    python = project / ".venv" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text(f'#!/bin/sh\n[ "$1" = -m ] && exit 1\nexec {sys.executable} "$@"\n')
    python.chmod(0o755)
    (project / "tools").mkdir()
    for name in ("tools/bootstrap.sh", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, project / name)
    done = subprocess.run(
        ["sh", "tools/bootstrap.sh", "install"],
        cwd=project,
        env={**os.environ, "TORCH_INDEX": index, "PYTHON": ""},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith("setup: torch 2.")
    assert ("TORCH_INDEX=ADDRESS" in line) == named
