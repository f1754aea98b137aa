"""Processes that open foreign videos and find people in them, with limits of memory and time.

A clip that fills the memory, hangs or kills its process ends that process alone. Frames stay
inside: a function of a module and its arguments go in, its result (figures, a track) comes out. A
process is kept for the next clip, because loading the pose model takes seconds. It is not a
sandbox: it has the rights of its user.
"""

import atexit
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar, cast

from robojackson.cli.lifetime.parent_death import watch_parent
from robojackson.errors import RoboJacksonError, UnreadableVideo
from robojackson.files.memory_limit import VIDEO_MEMORY, limited_memory
from robojackson.files.processor_cores import cores

if TYPE_CHECKING:
    from robojackson.clips.video import VideoInfo, VideoLimits

R = TypeVar("R")
Progress = Callable[[int, int], None]
Arguments = tuple[object, ...]
Outcome = tuple[str, object]
"""Kind of a message and its value."""
REPORT, ERROR, RESULT = "report", "error", "result"

OPENING_S, FRAME_S = 300.0, 2.0
"""Time limit of a video, and of each of its frames in addition, seconds: twenty times the usual on
one busy core."""
BETWEEN_REPORTS_S = 0.05
ATTEMPTS = 2
"""Attempts for a clip whose process died: the machine may have been short of memory."""


def probed(path: Path, limits: "VideoLimits") -> "VideoInfo":
    """Return the result of `clips.video.probe` from a separate process if the file exists.

    Raises:
        UnreadableVideo, TruncatedVideo, VideoTooLong, TrackTooShort: see there.
    """
    from robojackson.clips.video import probe
    from robojackson.clips.video_container import require_file

    require_file(path)
    return in_video_process(probe, path, limits)


def in_video_process(
    function: Callable[..., R],
    path: Path,
    *args: object,
    frames: int = 0,
    progress: Progress | None = None,
) -> R:
    """Call a function of a module with a video and more arguments in a process with limits.

    Args:
        frames: Number of frames that the function reads; the time limit grows with it.
        progress: Passed to the function as its keyword `progress`, and called here.
    Raises:
        UnreadableVideo: the process took too long, too much memory, or died of it.
        RoboJacksonError: the function raised it.
    """
    for _ in range(ATTEMPTS):
        with _places:
            reader = _free()
            try:
                return reader.call(function, (path, *args), OPENING_S + FRAME_S * frames, progress)
            except EOFError:
                how = reader.end()
            finally:
                if reader.is_idle:
                    _idle.append(reader)
    raise UnreadableVideo(
        f"reading it killed the process ({how}); write it again (ffmpeg -i IN OUT.mp4)", path
    )


HEAP = {"MALLOC_ARENA_MAX": "2"}
"""With a heap a thread, glibc's grow by a small picture a frame: 1.8 GB in 60 s, 0.4 with two."""


class _Reader:
    """A process and the connection to it; used by one thread at a time."""

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            # Not by multiprocessing, whose daemons, such as Dask's workers, may start no process.
            command = [sys.executable, "-P", "-m", __name__, str(theirs.fileno()), str(os.getpid())]
            path = os.pathsep.join(folder for folder in sys.path if folder)
            self._process = subprocess.Popen(
                command, pass_fds=[theirs.fileno()], env={**os.environ, **HEAP, "PYTHONPATH": path},
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            )  # fmt: skip
        self._connection = Connection(ours.detach())
        self.is_idle = True

    def call(
        self,
        function: Callable[..., R],
        args: Arguments,
        seconds: float,
        progress: Progress | None,
    ) -> R:
        """Return the function's result; in any other case end the process.

        Raises:
            EOFError: the process has died.
        """
        self.is_idle = False
        until = time.monotonic() + seconds
        try:
            with suppress(BrokenPipeError, ConnectionResetError):  # the answer has the cause
                self._connection.send((os.getcwd(), function, args, progress is not None))
            while self._connection.poll(max(until - time.monotonic(), 0.0)):
                kind, value = self._answer()
                if kind != REPORT:
                    break
                if progress:
                    progress(*cast(tuple[int, int], value))
            else:
                raise UnreadableVideo(f"not read within {seconds:.0f} s; trim it", args[0])
        except BaseException:
            self.end()
            raise
        self.is_idle = True
        if kind == ERROR:
            raise cast(BaseException, value)
        return cast(R, value)

    def end(self) -> str:
        """Kill the process and return how it ended."""
        self.is_idle = False
        self._connection.close()
        self._process.kill()
        code = self._process.wait()
        return signal.Signals(-code).name if code < 0 else f"exit code {code}"

    def _answer(self) -> Outcome:
        try:
            found: Outcome = self._connection.recv()
        except OSError as cause:
            raise EOFError from cause
        return found


_idle: list[_Reader] = []
_places = threading.BoundedSemaphore(cores())


def _free() -> _Reader:
    """Return a process that waits for work, or a new one."""
    with suppress(IndexError):  # another thread may take the last one
        return _idle.pop()
    return _Reader()


@atexit.register
def end_idle() -> None:
    """End the processes that wait for work."""
    while _idle:
        _idle.pop().end()


def _serve(parent: int, connection: Connection) -> None:
    """Handle requests until the parent closes the pipe; leave Ctrl-C to the parent."""
    os.environ["OMP_NUM_THREADS"] = "1"
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    watch_parent(parent)
    import cv2

    cv2.setNumThreads(1)
    with limited_memory(VIDEO_MEMORY), suppress(EOFError, BrokenPipeError):
        while True:
            folder, function, args, reports = connection.recv()
            os.chdir(folder)  # names may be relative to the caller's current folder
            more = {"progress": _Reporter(connection)} if reports else {}
            connection.send(_outcome(function, args, more))


def _outcome(
    function: Callable[..., object], args: Arguments, more: Mapping[str, object]
) -> Outcome:
    try:
        return RESULT, function(*args, **more)
    except RoboJacksonError as error:
        return ERROR, error
    except MemoryError:
        most = VIDEO_MEMORY / 2**30
        message = f"takes more than {most:.1f} GB of memory; make it smaller (ffmpeg -vf scale)"
        return ERROR, UnreadableVideo(message, args[0])
    except Exception as error:
        error.add_note(traceback.format_exc())
        return ERROR, error


class _Reporter:
    """Sends the progress, a few times a second."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._sent_s = connection, 0.0

    def __call__(self, done: int, total: int) -> None:
        now = time.monotonic()
        if done >= total or now >= self._sent_s + BETWEEN_REPORTS_S:
            self._sent_s = now
            self._connection.send((REPORT, (done, total)))


if __name__ == "__main__":
    _serve(int(sys.argv[2]), Connection(int(sys.argv[1])))
