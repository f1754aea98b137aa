"""The wheel where nothing else is installed: first without its extras, then with `[app]`.

    python -m pytest -m network tests/package/test_empty_environment.py

pip brings every library from the index, so this needs the network, gigabytes and minutes; the other
tests of this folder see the libraries of the developer's environment.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.package.conftest import ROOT, Installed, build
from tests.package.test_deployed_wheel import require_deployed_dance

pytestmark = [
    pytest.mark.slow,
    pytest.mark.network,
    pytest.mark.xdist_group("package"),
    pytest.mark.timeout(7200),
]
TORCH = "torch==2.13.0"
PYTHON = os.environ.get("EMPTY_PYTHON", sys.executable)
"""Which Python the environment is made with."""
RECOVER = """
import robojackson as rj
from pathlib import Path

motion = rj.recover_motion(Path({clip!r}), quality="lite")
reference = rj.retarget_motion(motion, "humanoid")
print(len(motion), reference.robot, Path(rj.__file__).is_relative_to({root!r}))
"""


def install(made: Installed, *words: object) -> None:
    """Install by the environment's own pip, within the versions of constraints.txt."""
    pip = (made.python, "-m", "pip", "install", "--quiet", "-c", ROOT / "constraints.txt")
    done = subprocess.run(
        [*map(str, (*pip, *words))], cwd=made.root, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def empty(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """Return an environment with the wheel and its requirements alone."""
    folder = tmp_path_factory.mktemp("empty")
    subprocess.run([PYTHON, "-m", "venv", folder / "venv"], check=True, cwd=folder)
    made = Installed(build(folder), folder / "venv")
    install(made, TORCH)
    install(made, made.wheel)
    return made


def test_the_stages_run_without_extras(empty: Installed, tmp_path: Path) -> None:
    missing = empty.run("python", "-c", "import prefect", cwd=tmp_path, code=1)
    assert "No module named 'prefect'" in missing.stderr
    missing = empty.run("python", "-c", "import tasks", cwd=tmp_path, code=1)
    assert "No module named 'tasks'" in missing.stderr
    code = RECOVER.format(clip=str(ROOT / "clips" / "hip_shake.mp4"), root=str(empty.root))
    output = empty.run("python", "-c", code, cwd=tmp_path, limit_s=1800).stdout
    assert output.splitlines()[-1] == "120 humanoid True"


def test_dance_says_what_to_install(empty: Installed, tmp_path: Path) -> None:
    refused = empty.run("robojackson", "dance", cwd=tmp_path, code=1)
    assert "pip install 'robojackson[app]'" in refused.stderr
    assert len(refused.stderr.strip().splitlines()) == 1


def test_everything_runs_with_the_extra(empty: Installed, tmp_path: Path) -> None:
    """The last test here: it changes the environment."""
    install(empty, f"{empty.wheel}[app]")
    words = ("dance", "--config", "smoke", "--trainer", "sb3", "--force", "--json")
    made = json.loads(empty.run("robojackson", *words, cwd=tmp_path, limit_s=1800).stdout)
    assert Path(made["page"]).is_file()
    (tmp_path / "deployed").mkdir()
    require_deployed_dance(empty, tmp_path / "deployed", limit_s=1800)
