"""The folder of a training on disk: its checkpoint and its results, written whole or not at all.

checkpoint/              everything needed to continue
checkpoint.old/          the one before, while the new one takes its place
policy.safetensors       the newest policy
networks.safetensors     the newest networks, for other trainings to start from
"""

import logging
import os
import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from robojackson.errors import RoboJacksonError, StoreError

log = logging.getLogger(__name__)

NETWORKS = "networks.safetensors"
RESULTS = ("policy.safetensors", NETWORKS)
CHECKPOINT, OLD_CHECKPOINT, REPLAY = "checkpoint", "checkpoint.old", "replay"
OWN_REPLAY = re.compile(r"[0-9]{12}-[0-9]{12}\.npz|new\.part")
"""Names of the files of a replay (`tqc.replay_files`)."""


def newest_checkpoint(out: Path) -> Path | None:
    """Return the last whole checkpoint: the previous one after a crash between two renames."""
    for name in (CHECKPOINT, OLD_CHECKPOINT):
        if (out / name / "run.json").exists():
            return out / name
    return None


@contextmanager
def restoring(folder: Path) -> Iterator[None]:
    """Raise `StoreError` where the files of a checkpoint are damaged.

    Args:
        folder: The checkpoint that is being read.
    """
    try:
        yield
    except RoboJacksonError:
        raise
    except Exception as cause:  # a damaged file fails in any way
        reason = f"{type(cause).__name__}: {' '.join(str(cause).split())}"[:200]
        raise StoreError(
            f"{folder}: the checkpoint is damaged ({reason}); remove it to begin again"
        ) from cause


def write_checkpoint(out: Path, save: Callable[[Path], None], results: Mapping[str, bytes]) -> None:
    """Replace the checkpoint and the results of a training.

    Args:
        out: Folder of the training.
        save: Function that writes the files of a checkpoint into a folder.
        results: Content of each of `RESULTS`.
    Raises:
        StoreError: the folder cannot be written; the previous checkpoint is still whole.
    """
    fresh, final = out / "checkpoint.new", out / CHECKPOINT
    shutil.rmtree(fresh, ignore_errors=True)
    try:
        fresh.mkdir()
        save(fresh)
        for name, content in results.items():
            (out / f"{name}.part").write_bytes(content)
        for file in (*fresh.iterdir(), *out.glob("*.safetensors.part")):
            _to_disk(file)
    except OSError as error:
        shutil.rmtree(fresh, ignore_errors=True)
        for part in out.glob("*.safetensors.part"):
            part.unlink(missing_ok=True)
        reason = error.strerror or f"No space left on device: {error}"  # NumPy's has no number
        raise StoreError(f"{out}: the checkpoint cannot be written ({reason})") from error
    # First, since a checkpoint whose budget is used up is not written again.
    for name in RESULTS:
        os.replace(out / f"{name}.part", out / name)
    old = out / OLD_CHECKPOINT
    if final.exists():
        shutil.rmtree(old, ignore_errors=True)
        final.rename(old)
    fresh.rename(final)
    shutil.rmtree(old, ignore_errors=True)


def require_free(out: Path) -> None:
    """Refuse a folder in which a training would replace files of something else.

    Raises:
        StoreError: `checkpoint` or `replay` is not of a training of ours.
    """
    if newest_checkpoint(out) is not None:
        return
    for name in (CHECKPOINT, OLD_CHECKPOINT):
        if (out / name).is_dir() and any((out / name).iterdir()):
            _refuse(out / name)
    replay = out / REPLAY
    if replay.is_dir() and not all(OWN_REPLAY.fullmatch(file.name) for file in replay.iterdir()):
        _refuse(replay)


def begin(out: Path) -> None:
    """Prepare the folder of a training that has no checkpoint: existing files are another's.

    Raises:
        StoreError: as `require_free`.
    """
    require_free(out)
    shutil.rmtree(out / REPLAY, ignore_errors=True)
    _set_results_aside(out)


def _refuse(folder: Path) -> None:
    raise StoreError(
        f"{folder}: holds files of something else, which a training here would replace; give "
        "another folder (-o)"
    )


def _set_results_aside(out: Path) -> None:
    """Rename the results of another training, which those of a new one would replace."""
    for name in RESULTS:
        if (out / name).is_file():
            os.replace(out / name, out / f"before-{name}")
            log.warning("%s existed; it is before-%s now", name, name)


def _to_disk(path: Path) -> None:
    with path.open("rb") as file:
        os.fsync(file.fileno())
