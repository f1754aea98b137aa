"""The end of a command by a signal: acknowledged, bounded, complete, with exit code 130."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from robojackson.cli.lifetime.orphans import HALF_WRITTEN
from robojackson.cli.lifetime.supervisor import SAME_S
from robojackson.files.local_folder import TEMPORARY
from tests.fixtures.commands import environment
from tools.stack.interrupted_command import living_with

ACKNOWLEDGED_S, ENDED_S = 5.0, 10.0
"""Generous multiples of 1 and 3 s, for a busy machine; benchmarks.orchestration.interruption_times
measures."""
SCRIPT = """
import itertools, os, signal, subprocess, sys, time
from robojackson.cli.lifetime.interruption import UnsavedFlag
from robojackson.cli.lifetime.supervisor import guarded

def say(text):
    print(text, file=sys.stderr, flush=True)

def command():
{body}
    return 0

sys.exit(guarded(command))
"""
HOLD_THE_INTERPRETER = "sum(itertools.repeat(0))"
"""A call that never returns, checks for no signal, and lets no other thread run."""
SWALLOW = """
while True:
    try:
        time.sleep(60)
    except KeyboardInterrupt:
        pass
"""
SAVE = """
flag = UnsavedFlag()
flag.set()
signal.pthread_sigmask(signal.SIG_BLOCK, {{signal.SIGINT}})
say('ready')
signal.sigwait({{signal.SIGINT}})
time.sleep({seconds})
open({path!r}, 'w').write('whole')
"""
Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Start a supervised command, and wait until it has written `ready`."""
    started: list[subprocess.Popen[str]] = []

    def begin(body: str, wait: bool = True, **more: str) -> subprocess.Popen[str]:
        lines = "".join(f"    {line}\n" for line in body.strip().splitlines())
        process = subprocess.Popen(
            [sys.executable, "-c", SCRIPT.format(body=lines)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment(TEST_FOLDER=str(tmp_path), **more),
            start_new_session=True,
        )
        started.append(process)
        if wait:
            assert process.stderr is not None
            assert process.stderr.readline() == "ready\n"
        return process

    yield begin
    for pid in living_with(f"TEST_FOLDER={tmp_path}"):
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    for process in started:
        process.communicate()


def is_alive(pid: int) -> bool:
    return state_of(pid) not in ("", "Z")


def state_of(pid: int) -> str:
    """Return the kernel's letter for a process, empty where there is none."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return ""


def becomes(pid: int, states: str) -> bool:
    """Return whether a process reaches one of the states soon."""
    until = time.monotonic() + ENDED_S
    while state_of(pid) not in states and time.monotonic() < until:
        time.sleep(0.02)
    return state_of(pid) in states


@pytest.mark.medium
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("send", [os.kill, os.killpg])
@pytest.mark.parametrize("body", [HOLD_THE_INTERPRETER, SWALLOW], ids=["C call", "swallowed"])
def test_a_command_that_does_not_react_is_acknowledged_and_ended(
    start: Start, body: str, send: Callable[[int, int], None], how: signal.Signals
) -> None:
    process = start(f"say('ready')\n{body}")
    assert process.stderr is not None
    sent = time.monotonic()
    send(process.pid, how)
    line = process.stderr.readline()
    acknowledged = time.monotonic() - sent
    out, rest = process.communicate()
    ended = time.monotonic() - sent
    assert line == "robojackson: interrupted, ending ...\n"
    assert (process.returncode, out) == (130, "")
    assert rest.splitlines() == ["robojackson: interrupted: resume: robojackson"]
    assert acknowledged < ACKNOWLEDGED_S
    assert ended < ENDED_S


def test_after_the_acknowledgement_the_command_writes_nothing(start: Start) -> None:
    process = start(
        "try:\n    say('ready'); time.sleep(60)\nfinally:\n    print('out'); say('err'); 1 / 0"
    )
    process.send_signal(signal.SIGINT)
    out, err = process.communicate()
    assert (process.returncode, out, len(err.splitlines())) == (130, "", 2)


@pytest.mark.medium
def test_a_command_with_learning_to_save_gets_the_time_for_it(start: Start, tmp_path: Path) -> None:
    file = tmp_path / "checkpoint"
    process = start(SAVE.format(seconds=4.0, path=str(file)))
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()
    assert "the training is saving its checkpoint (up to 30 s; Ctrl-C again ends at once)" in err
    assert (process.returncode, file.read_text()) == (130, "whole")


@pytest.mark.medium
def test_a_training_below_the_command_is_stopped_and_saves(start: Start, tmp_path: Path) -> None:
    file = tmp_path / "checkpoint"
    save = SAVE.format(seconds=3.0, path=str(file)).replace("SIGINT", "SIGTERM")
    child = (
        "import signal, sys, time\nfrom robojackson.cli.lifetime.interruption import UnsavedFlag\n"
        f"say = lambda text: print(text, file=sys.stderr, flush=True)\n{save}"
    )
    words = f"[sys.executable, '-c', {child!r}]"
    started = f"subprocess.Popen({words}, start_new_session=True)"
    process = start(f"signal.signal(signal.SIGINT, signal.SIG_IGN)\n{started}\n{SWALLOW}")
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()
    assert "the training is saving its checkpoint" in err
    assert (process.returncode, file.read_text()) == (130, "whole")


def test_a_second_signal_does_not_wait_for_the_checkpoint(start: Start, tmp_path: Path) -> None:
    file = tmp_path / "checkpoint"
    process = start(SAVE.format(seconds=25.0, path=str(file)))
    assert process.stderr is not None
    process.send_signal(signal.SIGINT)
    process.stderr.readline()
    time.sleep(2 * SAME_S)
    sent = time.monotonic()
    process.send_signal(signal.SIGINT)
    process.communicate()
    assert (process.returncode, file.exists()) == (130, False)
    assert time.monotonic() - sent < ENDED_S


@pytest.mark.medium
def test_a_signal_that_comes_twice_at_once_is_one(start: Start, tmp_path: Path) -> None:
    """A wrapper passes on the Ctrl-C that the terminal has sent to both."""
    file = tmp_path / "checkpoint"
    process = start(SAVE.format(seconds=3.0, path=str(file)))
    process.send_signal(signal.SIGINT)
    process.send_signal(signal.SIGTERM)
    process.communicate()
    assert (process.returncode, file.read_text()) == (130, "whole")


@pytest.mark.medium
def test_no_process_is_left_however_stubborn(start: Start) -> None:
    stubborn = (
        "import os, signal, sys, time\n"
        "for how in (signal.SIGINT, signal.SIGTERM): signal.signal(how, signal.SIG_IGN)\n"
        "print(os.getpid(), flush=True)\n"
        "print('ready', file=sys.stderr, flush=True)\n"
        "time.sleep(60)\n"
    )
    process = start(
        f"subprocess.Popen([sys.executable, '-c', {stubborn!r}], start_new_session=True)\n{SWALLOW}"
    )
    assert process.stdout is not None
    child = int(process.stdout.readline())
    process.send_signal(signal.SIGINT)
    assert process.wait() == 130
    assert not is_alive(child)


@pytest.mark.medium
@pytest.mark.parametrize("writer", ["command", "child"])
def test_a_file_that_is_being_written_is_removed_and_a_whole_one_stays(
    writer: str, start: Start, tmp_path: Path
) -> None:
    half, whole = tmp_path / f"{HALF_WRITTEN}x", tmp_path / "whole"
    body = (
        f"files = [open(path, 'w') for path in ({str(half)!r}, {str(whole)!r})]\n"
        f"print('ready', file=sys.stderr, flush=True)\n{HOLD_THE_INTERPRETER}"
    )
    if writer == "child":
        child = f"import itertools, sys\n{body}"
        body = f"subprocess.run([sys.executable, '-c', {child!r}], start_new_session=True)"
    process = start(body)
    process.send_signal(signal.SIGINT)
    process.communicate()
    assert (half.exists(), whole.exists()) == (False, True)


def test_the_store_names_half_written_files_as_the_supervisor_looks_for_them() -> None:
    assert HALF_WRITTEN == TEMPORARY


def test_the_worker_of_a_killed_supervisor_ends(start: Start) -> None:
    process = start(f"print(os.getpid(), flush=True)\nsay('ready')\n{SWALLOW}")
    assert process.stdout is not None
    worker = int(process.stdout.readline())
    assert worker != process.pid
    process.kill()
    process.wait()
    assert becomes(worker, "Z")


@pytest.mark.medium
def test_a_stopped_command_stops_and_goes_on(start: Start) -> None:
    process = start("print(os.getpid(), flush=True)\nsay('ready')\ntime.sleep(2)")
    assert process.stdout is not None
    worker = int(process.stdout.readline())
    process.send_signal(signal.SIGTSTP)
    assert becomes(worker, "T")
    assert becomes(process.pid, "T")
    process.send_signal(signal.SIGCONT)
    assert process.wait() == 0


@pytest.mark.parametrize(
    ("body", "code", "line"),
    [
        ("return 3", 3, ""),
        ("sys.exit(4)", 4, ""),
        ("os.kill(os.getpid(), 9)", 137, "killed by SIGKILL (by hand, or out of memory); resume:"),
        ("os.kill(os.getpid(), 11)", 139, "killed by SIGSEGV; resume:"),
    ],
)
def test_a_command_that_ends_by_itself_has_its_own_exit_code(
    start: Start, body: str, code: int, line: str
) -> None:
    process = start(f"print('answer', flush=True)\n{body}", wait=False)
    out, err = process.communicate()
    assert (process.returncode, out) == (code, "answer\n")
    assert line in err
    assert len(err.splitlines()) == bool(line)


def test_the_exit_code_survives_a_parent_that_ignores_the_ends_of_its_children() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT.format(body="    return 3\n")],
        stderr=subprocess.PIPE,
        env=environment(),
        check=False,
        preexec_fn=lambda: signal.signal(signal.SIGCHLD, signal.SIG_IGN),
    )
    assert (done.returncode, done.stderr) == (3, b"")


@pytest.mark.medium
def test_a_signal_that_the_shell_has_ignored_is_obeyed(tmp_path: Path) -> None:
    """A script's `&` has SIGINT ignored."""
    body = f"    say('ready')\n    {HOLD_THE_INTERPRETER}\n"
    with subprocess.Popen(
        [sys.executable, "-c", SCRIPT.format(body=body)],
        stderr=subprocess.PIPE,
        env=environment(),
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
    ) as process:
        assert process.stderr is not None
        process.stderr.readline()
        process.send_signal(signal.SIGINT)
    assert process.returncode == 130


@pytest.mark.medium
def test_an_acknowledgement_that_none_can_read_delays_nothing(start: Start) -> None:
    """Ctrl-C in a pipeline ends the reader of stderr, too."""
    process = start(f"say('ready')\n{HOLD_THE_INTERPRETER}")
    assert process.stderr is not None
    process.stderr.close()
    process.send_signal(signal.SIGINT)
    assert process.wait() == 130
    process.stderr = None


def test_children_of_the_command_block_and_ignore_no_signal(start: Start) -> None:
    child = (
        "import signal; print(signal.pthread_sigmask(signal.SIG_BLOCK, []), "
        "signal.getsignal(2) is signal.default_int_handler, signal.getsignal(15).name)"
    )
    process = start(f"subprocess.run([sys.executable, '-c', {child!r}])", wait=False)
    out, _ = process.communicate()
    assert out == "set() True SIG_DFL\n"


def test_a_process_that_a_command_of_ours_started_has_no_supervisor_of_its_own(
    start: Start,
) -> None:
    process = start("print(os.getpid(), flush=True)", wait=False, ROBOJACKSON_FLOW="mark")
    out, _ = process.communicate()
    assert int(out) == process.pid
