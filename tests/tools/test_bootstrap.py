"""What `make` runs first, before anything of ours is installed."""

import os
import shutil
import subprocess
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
