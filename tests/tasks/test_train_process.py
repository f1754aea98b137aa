"""A training is a process of its own: it leaves no orphan, and its death has a name."""

import asyncio
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from robojackson.errors import TrainingFailed
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.config.train_config import TrainConfig
from robojackson.robot.description import RobotDescription
from storage.store import Store
from tasks import train_policy
from tasks.runtime import child_process
from tests.fixtures.robots import robot_motion

SLEEPER = "import time; print('started', file=__import__('sys').stderr, flush=True); time.sleep(60)"
STUBBORN = f"import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); {SLEEPER}"


def run(code: str, folder: Path, limit_s: float | None = None) -> None:
    command = [sys.executable, "-c", code]
    asyncio.run(child_process.run_process(command, "walk-scratch-s0", folder, limit_s))


def is_alive(pid: int) -> bool:
    """Return whether a process runs; one that only waits to be collected does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state != "Z"


def ends(pid: int, within_s: float = 10.0) -> bool:
    until = time.monotonic() + within_s
    while time.monotonic() < until:
        if not is_alive(pid):
            return True
        time.sleep(0.05)
    return False


def test_a_process_that_is_killed_is_reported_with_its_run_and_cause(tmp_path: Path) -> None:
    with pytest.raises(
        TrainingFailed, match=r"run walk-scratch-s0 was killed by SIGKILL"
    ) as caught:
        run("import os; os.kill(os.getpid(), 9)", tmp_path)
    assert str(tmp_path / child_process.LOG) in str(caught.value)


def test_a_process_that_fails_is_reported_with_its_last_line(tmp_path: Path) -> None:
    with pytest.raises(TrainingFailed, match="exit code 3: the disk is full"):
        run("import sys; print('the disk is full', file=sys.stderr); sys.exit(3)", tmp_path)


def test_what_the_process_says_is_in_its_log(tmp_path: Path) -> None:
    run("import sys; print('10 steps', file=sys.stderr)", tmp_path)
    assert (tmp_path / child_process.LOG).read_text() == "10 steps\n"


def test_words_of_any_language_are_in_the_log_whatever_the_locale(tmp_path: Path) -> None:
    say = f"import sys; sys.stderr.buffer.write(bytes.fromhex({'춤'.encode().hex()!r}))"
    code = (
        "import asyncio, sys; from pathlib import Path; from tasks.runtime import child_process; "
        f"command = [sys.executable, '-c', {say!r}]; "
        "asyncio.run(child_process.run_process(command, 'run', Path(sys.argv[1])))"
    )
    plain = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}
    folders = os.pathsep.join(filter(None, sys.path))
    subprocess.run(
        [sys.executable, "-c", code, tmp_path],
        env={**os.environ, **plain, "PYTHONPATH": folders},
        check=True,
    )
    assert (tmp_path / child_process.LOG).read_text(encoding="utf-8") == "춤\n"


@pytest.mark.parametrize("letters", [1_000, 70_000, 300_000])
def test_a_line_of_any_length_ends_no_training(letters: int, tmp_path: Path) -> None:
    code = f"import sys; print('x' * {letters} + '\\nready', file=sys.stderr)"
    run(code, tmp_path)
    *parts, last = (tmp_path / child_process.LOG).read_text().split()
    assert ("".join(parts), last) == (letters * "x", "ready")


@pytest.mark.medium
def test_a_process_that_does_not_end_is_killed(tmp_path: Path) -> None:
    with pytest.raises(TrainingFailed, match="did not end within"):
        run(SLEEPER, tmp_path, 1.0)


@pytest.mark.parametrize(
    ("code", "grace_s", "times"),
    [(SLEEPER, 0.5, 1), (STUBBORN, 0.5, 1), (STUBBORN, 60.0, 2)],
    ids=["willing", "stubborn", "stubborn and cancelled again while it ends"],
)
def test_a_cancelled_task_leaves_no_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str, grace_s: float, times: int
) -> None:
    monkeypatch.setattr(child_process, "SECONDS_TO_SAVE", grace_s)
    output = f"import os, sys; print(os.getpid(), file=sys.stderr, flush=True); {code}"

    async def cancelled() -> None:
        command = [sys.executable, "-c", output]
        running = asyncio.create_task(child_process.run_process(command, "run", tmp_path, None))
        while "started" not in _read(tmp_path / child_process.LOG):
            await asyncio.sleep(0.02)
        for _ in range(times):
            running.cancel()
            await asyncio.sleep(0.2)
        await asyncio.gather(running, return_exceptions=True)

    asyncio.run(cancelled())
    assert ends(int(_read(tmp_path / child_process.LOG).split()[0]), 10.0)


def test_a_training_ends_when_its_parent_is_killed(tmp_path: Path) -> None:
    child = (
        "import os, sys, time\n"
        "from robojackson.cli.learning.training_process import end_with\n"
        "end_with(int(sys.argv[1]))\n"
        "open(sys.argv[2], 'w').write(str(os.getpid()))\n"
        "time.sleep(60)\n"
    )
    parent = (
        "import os, subprocess, sys\n"
        f"subprocess.run([sys.executable, '-c', {child!r}, str(os.getpid()), sys.argv[1]])\n"
    )
    mark = tmp_path / "pid"
    command = [sys.executable, "-c", parent, str(mark)]
    with subprocess.Popen(command, env=child_process.environment()) as process:
        while not _read(mark):
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
    assert ends(int(_read(mark)))


def test_a_training_whose_parent_is_gone_does_not_begin() -> None:
    code = "from robojackson.cli.learning.training_process import end_with; end_with(1)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        check=False,
        env=child_process.environment(),
    )
    assert b"is gone" in done.stderr


def _read(path: Path) -> str:
    return path.read_text() if path.exists() else ""


@pytest.mark.parametrize(("name", "searches"), [("g1", True), ("humanoid", False)])
def test_a_training_on_top_of_feedback_has_time_for_its_search(
    name: str, searches: bool, tmp_path: Path
) -> None:
    motion = robot_motion("hip_shake")
    reference = motion.save(tmp_path / "reference.parquet")
    found = train_policy._overtime_s(reference, describe_robot(name), TrainConfig(mode="track"))
    search_s = train_policy.SEARCH_S_A_SECOND * len(motion) * motion.dt
    assert found == pytest.approx(train_policy.OVERTIME_S + (search_s if searches else 0.0))


def test_a_setup_may_have_the_name_of_another_file_of_the_training(tmp_path: Path) -> None:
    labels = train_policy.RunLabels("walk", "robot")
    description, config = describe_robot("humanoid"), TrainConfig(seed=7)
    words = train_policy._command(tmp_path, tmp_path, description, config, labels, "run", 1.0)
    named = {key: Path(words[words.index(key) + 1]) for key in ("--setup", "--robot")}
    assert load(TrainConfig, str(named["--setup"])).seed == 7
    assert load(RobotDescription, str(named["--robot"])).name == "humanoid"


def test_the_logs_of_a_training_are_kept_in_the_store(
    store_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store(store_folder).create()

    async def trained(command: object, run_id: str, work: Path, limit_s: object) -> bytes:
        for name in ("policy.safetensors", "episodes.parquet", "tensorboard/events.1"):
            (work / name).parent.mkdir(exist_ok=True)
            (work / name).write_bytes(b"made")
        facts = {"trainer": "sb3", "seed": 0, "steps": 1, "updates": 0, "stopped": "steps"}
        return json.dumps({**facts, "episodes": 0, "seconds": 1}).encode()

    @asynccontextmanager
    async def silent(*words: object) -> AsyncIterator[None]:
        yield

    monkeypatch.setattr(train_policy, "run_process", trained)
    monkeypatch.setattr(train_policy, "show_progress", silent)
    with store.scratch() as folder:
        path = robot_motion("hip_shake").save(folder / "reference.parquet")
        reference = store.save("retarget", "reference.parquet", path)
    labels = train_policy.RunLabels("hip_shake", "scratch")
    config = TrainConfig(steps=10, tensorboard=True)
    robot = describe_robot("humanoid")
    asyncio.run(train_policy.train_policy.fn(reference, robot, config, labels))
    (log,) = store.list("tensorboard")
    assert log.endswith("/events.1")
    assert store.read(log) == b"made"
