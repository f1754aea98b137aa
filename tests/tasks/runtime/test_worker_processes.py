"""Work in other processes: a crash is one clip's, and nobody outlives the parent."""

import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from robojackson.errors import UnreadableVideo
from tasks.runtime.worker_processes import in_worker

ROOT = Path(__file__).parents[3]
ORPHANS = """
import os, signal, sys, time
from tasks.runtime.worker_processes import in_worker
if __name__ == "__main__":
    print(in_worker(os.getpid), flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_work_is_done_in_another_process() -> None:
    assert in_worker(os.getpid) != os.getpid()


def test_an_error_of_the_work_comes_back() -> None:
    with pytest.raises(ZeroDivisionError):
        in_worker(divmod, 1, 0)


@pytest.mark.slow
def test_a_clip_that_kills_its_process_harms_no_other() -> None:
    with ThreadPoolExecutor(4) as threads:
        good = [threads.submit(in_worker, pow, 2, n) for n in range(3)]
        bad = threads.submit(in_worker, os._exit, 3)
        good += [threads.submit(in_worker, pow, 2, n) for n in range(3, 6)]
        assert isinstance(bad.exception(), UnreadableVideo)
        assert [future.result() for future in good] == [1, 2, 4, 8, 16, 32]


@pytest.mark.medium
def test_a_process_ends_with_its_parent(tmp_path: Path) -> None:
    script = tmp_path / "orphans.py"
    script.write_text(ORPHANS)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, str(script)], env=environment, stdout=subprocess.PIPE, check=False
    )
    worker = int(done.stdout)
    until = time.monotonic() + 10
    while Path(f"/proc/{worker}").exists() and time.monotonic() < until:
        time.sleep(0.1)
    assert not Path(f"/proc/{worker}").exists()
