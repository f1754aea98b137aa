"""Processes for videos of strangers: limits of memory and time, and a crash is one clip's."""

import os
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from robojackson.cli.lifetime import video_process
from robojackson.cli.lifetime.video_process import in_video_process, probed
from robojackson.clips.video import VideoLimits, probe
from robojackson.errors import TruncatedVideo, UnreadableVideo, VideoTooLong

ROOT = Path(__file__).parents[3]
CLIP = ROOT / "clips" / "hip_shake.mp4"
ORPHANS = """
import os, signal, sys, time
from pathlib import Path
from tests.cli.lifetime.test_video_process import number
from robojackson.cli.lifetime.video_process import in_video_process
if __name__ == "__main__":
    print(in_video_process(number, Path()), flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""


def number(_: Path) -> int:
    return os.getpid()


def die(_: Path, code: int) -> None:
    os._exit(code)


def sleep(_: Path, seconds: float) -> None:
    time.sleep(seconds)


def fill(_: Path, gigabytes: int) -> int:
    return int(np.ones((gigabytes, 2**27)).sum())


def divide(_: Path, a: int, b: int) -> float:
    return a / b


def count(_: Path, progress: Callable[[int, int], None]) -> None:
    for done in range(1, 4):
        progress(done, 3)
        time.sleep(0.1)


def speak(_: Path) -> None:
    os.write(2, b"terminate called\n")


def test_work_is_done_in_another_process_that_is_kept() -> None:
    first = in_video_process(number, Path())
    assert first == in_video_process(number, Path()) != os.getpid()


def test_its_heap_does_not_grow_with_every_thread() -> None:
    assert in_video_process(os.getenv, "MALLOC_ARENA_MAX") == "2"


def test_the_properties_of_a_video_are_the_same() -> None:
    assert probed(CLIP, VideoLimits()) == probe(CLIP, VideoLimits())


def test_errors_come_back_as_they_are(tmp_path: Path) -> None:
    cut = tmp_path / "cut.mp4"
    cut.write_bytes(CLIP.read_bytes()[:5000])
    with pytest.raises(TruncatedVideo, match="holds 0 of the 120 frames"):
        probed(cut, VideoLimits())
    with pytest.raises(VideoTooLong):
        probed(CLIP, VideoLimits(max_duration_s=0.1))
    with pytest.raises(ZeroDivisionError) as caught:
        in_video_process(divide, Path(), 1, 0)
    assert "in divide" in caught.value.__notes__[0]


def test_progress_is_reported_here() -> None:
    seen: list[tuple[int, int]] = []
    in_video_process(count, Path(), progress=lambda done, total: seen.append((done, total)))
    assert seen == [(1, 3), (2, 3), (3, 3)]


def test_a_video_that_takes_too_much_memory_is_refused() -> None:
    with pytest.raises(UnreadableVideo, match=r"more than 2\.5 GB of memory"):
        in_video_process(fill, Path("big.mp4"), 4)
    assert in_video_process(divide, Path(), 1, 1) == 1


def test_a_video_that_takes_too_long_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    in_video_process(number, Path())
    monkeypatch.setattr(video_process, "OPENING_S", 0.2)
    began = time.monotonic()
    with pytest.raises(UnreadableVideo, match=r"slow\.mp4: not read within 2 s"):
        in_video_process(sleep, Path("slow.mp4"), 60.0, frames=1)
    assert time.monotonic() - began < 10


def test_what_a_process_writes_on_stderr_stays_there(capfd: pytest.CaptureFixture[str]) -> None:
    in_video_process(speak, Path())
    assert not capfd.readouterr().err


@pytest.mark.medium
def test_a_daemon_of_multiprocessing_can_have_one() -> None:
    """As a worker of Dask is."""
    with get_context("spawn").Pool(1) as pool:
        assert pool.apply(in_video_process, (divide, Path(), 6, 2)) == 3


@pytest.mark.slow
def test_a_clip_that_kills_its_process_harms_no_other() -> None:
    with ThreadPoolExecutor(4) as threads:
        good = [threads.submit(in_video_process, divide, Path(), n, 1) for n in range(3)]
        bad = threads.submit(in_video_process, die, Path("bad.mp4"), 3)
        good += [threads.submit(in_video_process, divide, Path(), n, 1) for n in range(3, 6)]
        assert "bad.mp4: reading it killed the process (exit code 3)" in str(bad.exception())
        assert [future.result() for future in good] == [0, 1, 2, 3, 4, 5]


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
