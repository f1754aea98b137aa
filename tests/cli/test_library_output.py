"""No line of a library reaches the terminal: every line of a command is one of ours."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fixtures.commands import ROOT, Said, environment

pytestmark = pytest.mark.xdist_group("library_output")
SMOKE = ("--config", "smoke")
STEPS = ("--steps=2000", "--trainer=sb3", "--set=tqc.n_envs=4", "--set=progress_seconds=0.5")
FILM = ("--video", "--set", "render.max_seconds=0.3")
OURS = re.compile(
    r"""
      .+\ \d+/\d+,\ [\d.]+/s,\ \d+\ s\ left              # a bar in a file
    | cycle:\ frames\ .+ | no\ cycle.* | costs\ from\ .+ | slowed\ down\ .+ | .*repair.*
    | of\ a\ perfect\ dance's\ reward:\ .+
    | \s*[\d,]+\ steps\ .+ left                          # a training
    | \w+\ \d+0\ %                                       # an evaluation
    | \d\d:\d\d:\d\d\.\d+\ \|\ INFO\ +\|\ (prefect|(Flow|Task)\ run\ .+)\ -\ .+
    """,
    re.VERBOSE,
)
"""What our commands write beside their answer where stderr is no terminal; the last is the record
of a flow, which a terminal does not show."""
NOISY = """
import logging, sys, warnings
from robojackson.cli.start import start

def body():
    import typer
    from robojackson.cli.console import CommandResult, command, log_to_stderr

    @command
    def noisy(as_json: bool = False) -> CommandResult:
        log_to_stderr()
        warnings.simplefilter("always")
        warnings.warn("from a library", UserWarning)
        warnings.warn("old", DeprecationWarning)
        logging.getLogger("OpenGL.acceleratesupport").info("No OpenGL_accelerate module loaded")
        logging.getLogger("absl").warning("from absl")
        logging.getLogger("jax._src.xla_bridge").warning("An NVIDIA GPU may be present")
        logging.getLogger("robojackson.anything").info("ours")
        return CommandResult({}, text=["answer"])

    app = typer.Typer()
    app.command()(noisy)
    return app(standalone_mode=False) or 0

start(body)
"""


def run(*words: object, **more: str) -> Said:
    """Run the command as a user starts it."""
    own = {"TF_CPP_MIN_LOG_LEVEL", "GLOG_minloglevel", "PYTHONWARNINGS", "MUJOCO_GL"}
    outer = {key: value for key, value in environment(**more).items() if key not in own}
    command = [sys.executable, *map(str, words)]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=400, env=outer, check=False,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip
    return Said(done.returncode, done.stdout, done.stderr)


def strange(output: Said) -> list[str]:
    """Return the lines of stderr that are not ours."""
    lines = (line for line in output.err.splitlines() if line.strip())
    return [line for line in lines if not OURS.fullmatch(line)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("quiet")


@pytest.fixture(scope="module")
def scored(short_clip: Path) -> Said:
    return run("-m", "robojackson", "score", short_clip, *SMOKE)


@pytest.fixture(scope="module")
def captured(short_clip: Path, folder: Path) -> Said:
    return run("-m", "robojackson", "mocap", short_clip, "-o", folder, *FILM, *SMOKE)


@pytest.fixture(scope="module")
def retargeted(captured: Said, folder: Path) -> Said:
    smpl = folder / "smpl.parquet"
    return run("-m", "robojackson", "retarget", smpl, "-o", folder, *FILM, *SMOKE)


@pytest.fixture(scope="module")
def trained(retargeted: Said, folder: Path) -> Said:
    reference = folder / "reference.parquet"
    return run("-m", "robojackson", "train", reference, "-o", folder / "run", *STEPS)


@pytest.fixture(scope="module")
def evaluated(trained: Said, folder: Path) -> Said:
    policy, reference = folder / "run" / "policy.safetensors", folder / "reference.parquet"
    return run("-m", "robojackson", "evaluate", policy, reference, *SMOKE)


@pytest.fixture(scope="module")
def danced(short_clip: Path, folder: Path) -> Said:
    store = str(folder / "store")
    words = ("dance", short_clip, "--minutes=0.2", "--force", *SMOKE)
    return run("-m", "robojackson", *words, ROBOJACKSON_STORE=store)


@pytest.mark.slow
@pytest.mark.parametrize(
    "command", ["scored", "captured", "retargeted", "trained", "evaluated", "danced"]
)
def test_every_line_of_a_command_is_ours(command: str, request: pytest.FixtureRequest) -> None:
    result: Said = request.getfixturevalue(command)
    assert result.code == 0, result.err
    assert strange(result) == []


@pytest.mark.slow
@pytest.mark.parametrize("command", ["scored", "captured", "retargeted", "trained", "evaluated"])
def test_the_answer_is_alone_on_stdout(command: str, request: pytest.FixtureRequest) -> None:
    result: Said = request.getfixturevalue(command)
    assert not re.search(r"WARNING|Warning:|OpenGL|absl|[IWE]\d{4} \d\d:", result.out)


def test_warnings_and_logs_of_packages_are_dropped_and_ours_are_shown() -> None:
    result = run("-c", NOISY)
    assert (result.out, result.err) == ("answer\n", "ours\n")


def test_warnings_are_shown_on_request() -> None:
    result = run("-W", "default", "-c", NOISY)
    assert "from a library" in result.err


def test_a_simulation_that_diverges_writes_no_line_and_no_file(tmp_path: Path) -> None:
    code = """
import mujoco
from robojackson.api.robots import load_robot
model = load_robot("humanoid").model
data = mujoco.MjData(model)
data.qvel[:] = 1e12
mujoco.mj_step(model, data)
assert data.warning.number.sum()
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert (done.stdout, done.stderr) == ("", "")
    assert list(tmp_path.iterdir()) == []
