"""`robojackson --version`, and the words that a shell completes."""

import os
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from tests.fixtures.commands import ROOT, environment, in_process

COMPLETE = "_ROBOJACKSON_COMPLETE"
ASK = """
source "$1"
COMP_WORDS=($2); COMP_CWORD=$(( ${#COMP_WORDS[@]} - 1 ))
complete -p robojackson
_robojackson_completion robojackson
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture(scope="module")
def command(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the command `robojackson` of this interpreter."""
    folder = tmp_path_factory.mktemp("bin")
    program = folder / "robojackson"
    program.write_text(f"#!{sys.executable}\nfrom robojackson.__main__ import main\n\nmain()\n")
    program.chmod(0o755)
    return folder


def completions(command: Path, words: str) -> list[str]:
    """Return what bash offers after these words, the last of them incomplete."""
    path = f"{command}{os.pathsep}{os.environ['PATH']}"
    env = environment(PATH=path)
    script = subprocess.run(
        ["robojackson"], env=env | {COMPLETE: "source_bash"}, capture_output=True, check=True
    )
    (command / "completion.sh").write_bytes(script.stdout)
    shell = ["bash", "-c", ASK, "bash", str(command / "completion.sh"), words]
    done = subprocess.run(shell, env=env, capture_output=True, text=True, check=True, cwd=ROOT)
    first, *found = done.stdout.split("\n")
    assert first.startswith("complete ")
    return [word for word in found if word]


def test_the_version_is_that_of_the_package() -> None:
    result = in_process("--version")
    assert (result.code, result.err) == (0, "")
    assert result.out == f"robojackson {version('robojackson')}, Python {sys.version.split()[0]}\n"


@pytest.mark.medium
@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("robojackson ret", ["retarget"]),
        ("robojackson retarget smpl.parquet --robot humanoid_st", ["humanoid_strong"]),
        ("robojackson train reference.parquet --setup scratch-", ["scratch-curiosity"]),
        ("robojackson train --traine", ["--trainer"]),
    ],
)
def test_bash_completes_commands_options_and_names(
    words: str, offered: list[str], command: Path
) -> None:
    assert completions(command, words) == offered
