"""The examples and the notebook run from the installed package."""

import json
from pathlib import Path

import nbformat
import pytest
from jupyter_client.kernelspec import KernelSpecManager
from jupyter_client.manager import KernelManager
from nbclient import NotebookClient

from tests.package.conftest import ROOT, Installed

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("package"), pytest.mark.timeout(400)]
EXAMPLES = ROOT / "examples"
FEW = "3000"
"""Control steps: enough for a policy, not for a dance."""


def test_a_video_becomes_a_motion(installed: Installed, tmp_path: Path) -> None:
    done = installed.run("python", EXAMPLES / "video_to_motion.py", cwd=tmp_path)
    assert "SmplSequence(120 frames at 30 fps" in done.stdout
    assert (tmp_path / "smpl.parquet").is_file()
    assert (tmp_path / "motion.bvh").read_text().startswith("HIERARCHY")


@pytest.mark.heavy
def test_a_file_of_amass_becomes_a_dancing_robot(installed: Installed, tmp_path: Path) -> None:
    done = installed.run("python", EXAMPLES / "amass_to_dance.py", "", FEW, cwd=tmp_path)
    assert "TrainedPolicy(robot='humanoid'" in done.stdout
    assert "73 rollouts)" in done.stdout
    assert (tmp_path / "amass_dance.mp4").stat().st_size > 10_000
    assert (tmp_path / "amass_run" / "policy.safetensors").is_file()


@pytest.mark.heavy
def test_a_reward_of_ones_own_is_paid(installed: Installed, tmp_path: Path) -> None:
    done = installed.run("python", EXAMPLES / "own_reward.py", FEW, cwd=tmp_path)
    output = next(line for line in done.stdout.splitlines() if line.startswith("quiet_hands"))
    first, last = map(float, output.split(":")[1].split())
    assert first < 0 > last


def test_the_notebook_runs(
    installed: Installed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the Python of the environment as its kernel."""
    kernels = tmp_path / "kernels" / "python3"
    kernels.mkdir(parents=True)
    command = [str(installed.python), "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    spec = {"argv": command, "display_name": "python3", "language": "python"}
    (kernels / "kernel.json").write_text(json.dumps(spec))
    monkeypatch.setenv("STEPS", FEW)
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "store"))
    monkeypatch.delenv("PYTHONPATH", raising=False)
    notebook = nbformat.read(EXAMPLES / "robojackson.ipynb", as_version=4)
    found = KernelSpecManager(kernel_dirs=[str(tmp_path / "kernels")], ensure_native_kernel=False)
    manager = KernelManager(kernel_name="python3", kernel_spec_manager=found)
    client = NotebookClient(
        notebook, km=manager, timeout=280, resources={"metadata": {"path": str(tmp_path)}}
    )
    client.execute()
    result = json.dumps([cell.get("outputs", []) for cell in notebook.cells])
    assert "TrainedPolicy(" in result
    assert "image/png" in result
    assert (tmp_path / "dance.mp4").is_file()


def test_the_notebook_is_kept_without_results() -> None:
    notebook = nbformat.read(EXAMPLES / "robojackson.ipynb", as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells)
