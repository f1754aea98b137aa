"""What `tools/bare_debian.sh` runs, and where, with stand-ins for the programs that need root."""

import os
import shutil
import subprocess
from pathlib import Path

from tools.stack.service import ROOT

PROGRAMS = {
    "debootstrap": 'mkdir -p "$3/etc" && echo 12.9 >"$3/etc/debian_version"',
    "mount": ":",
    "umount": ":",
    "chroot": 'for word in "$@"; do printf "%s\\n" "$word"; done >>"$CALLS"; echo --- >>"$CALLS"',
}


def test_values_with_spaces_and_a_relative_folder_reach_the_system(tmp_path: Path) -> None:
    """Two more indexes are one PIP_EXTRA_INDEX_URL; the folder is that of the caller's."""
    project, programs, calls = tmp_path / "project", tmp_path / "bin", tmp_path / "calls"
    (project / "tools").mkdir(parents=True)
    shutil.copy(ROOT / "tools" / "bare_debian.sh", project / "tools")
    (project / "new.txt").write_text("of this checkout")
    subprocess.run(["git", "init", "--quiet"], cwd=project, check=True)
    programs.mkdir()
    for name, line in PROGRAMS.items():
        (programs / name).write_text(f"#!/bin/sh\n{line}\n")
        (programs / name).chmod(0o755)
    (tmp_path / "here").mkdir()
    own = {"CALLS": str(calls), "DANCE": "", "TESTS": "", "PIP_EXTRA_INDEX_URL": "first second"}
    done = subprocess.run(
        ["sh", "../project/tools/bare_debian.sh", "bookworm", "system"],
        cwd=tmp_path / "here",
        env={**os.environ, **own, "PATH": f"{programs}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "here" / "system"
    assert (folder / "robojackson" / "new.txt").read_text() == "of this checkout"
    runs = [run.splitlines() for run in calls.read_text().split("---\n") if run]
    assert len(runs) >= 5
    for run in runs:
        assert run[:3] == [str(folder), "env", "-i"]
        assert "PIP_EXTRA_INDEX_URL=first second" in run
    assert runs[-1][-1].startswith("cd /robojackson && .venv/bin/python --version")
