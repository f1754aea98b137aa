"""The built package in an environment of its own."""

import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.fixtures import checkout

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Installed:
    """An environment in which the wheel is installed and the checkout is not.

    Attributes:
        wheel: The file.
        root: Of the environment.
    """

    wheel: Path
    root: Path

    @property
    def python(self) -> Path:
        return self.root / "bin" / "python"

    @property
    def packages(self) -> Path:
        return next((self.root / "lib").glob("python*/site-packages"))

    def run(
        self, *words: object, cwd: Path, code: int = 0, limit_s: float = 280, **extra: str
    ) -> subprocess.CompletedProcess[str]:
        """Run a program of the environment, away from the checkout."""
        kept = {k: os.environ[k] for k in ("PATH", "LANG", "LD_LIBRARY_PATH") if k in os.environ}
        fixed = {"HOME": str(cwd), "OMP_NUM_THREADS": "1", "ROBOJACKSON_STORE": str(cwd / "store")}
        program, *rest = map(str, words)
        done = subprocess.run(
            [self.root / "bin" / program, *rest], cwd=cwd, env={**kept, **fixed, **extra},
            capture_output=True, text=True, timeout=limit_s, check=False,
        )  # fmt: skip
        assert done.returncode == code, done.stdout[-2000:] + done.stderr[-3000:]
        return done


def build(folder: Path) -> Path:
    """Build the wheel from a copy of the repository's files."""
    copy = folder / "checkout"
    for name in checkout.files():
        if not name.startswith(("tests/", "docs/", "benchmarks/")):
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, copy / name)
    words = ("-m", "build", "--wheel", "--no-isolation", "--outdir", folder / "dist", copy)
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return next((folder / "dist").glob("*.whl"))


def environment(folder: Path, wheel: Path) -> Installed:
    """Return an environment with the wheel, and the libraries of this one by a path file.

    A folder in a path file is searched, its own path files are not: so the checkout that is
    installed here in editable mode is not found there.
    """
    run: Sequence[object] = (sys.executable, "-m", "venv", "--without-pip", folder)
    subprocess.run(list(map(str, run)), check=True)
    made = Installed(wheel, folder)
    (made.packages / "libraries.pth").write_text(sysconfig.get_path("purelib") + "\n")
    pip = (sys.executable, "-m", "pip", "--python", made.python, "install", "--quiet")
    words = (*pip, "--no-deps", "--no-index", "--force-reinstall", wheel)
    subprocess.run(list(map(str, words)), check=True, capture_output=True)
    return made


@pytest.fixture(scope="session")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """Return the package as a user installs it."""
    folder = tmp_path_factory.mktemp("package")
    return environment(folder / "venv", build(folder))
