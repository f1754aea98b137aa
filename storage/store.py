"""Where artifacts live: a local folder by default, any fsspec address by configuration.

Keys are relative to the root. Whatever goes wrong in a place is one `StoreError` with one line.
"""

import hashlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from robojackson.errors import StoreError
from robojackson.pipeline.folder_lock import A_MOMENT, locked
from storage.artifact import Artifact, sha256_of, sha256_of_file
from storage.places import TEMPORARY, Folder, Place, place_at

VARIABLE = "ROBOJACKSON_STORE"
DEFAULT_ROOT = "store"
SCRATCH, HELD = "scratch", ".held"
"""The folder of folders that go away, and the file in each that its process has locked."""


class Store:
    """Files by key, under one root.

    Attributes:
        root: Path or URL, as given.
        place: The folder or whatever else keeps the files.
    """

    def __init__(self, root: str | Path, place: Place | None = None) -> None:
        self.root = str(root)
        with _one_line(f"cannot open the store {self.root}"):
            self.place: Place = place or place_at(self.root)

    @classmethod
    def from_environment(cls) -> "Store":
        """The store that `ROBOJACKSON_STORE` names, `./store` without it."""
        return cls(os.environ.get(VARIABLE) or DEFAULT_ROOT)

    def create(self) -> "Store":
        """The store itself, its folder or bucket made if it is not there."""
        with _one_line(f"cannot make the store {self.root}"):
            self.place.create()
        return self

    def put(self, key: str, content: bytes | Path) -> Artifact:
        """Write bytes, or copy a local file, under a key; replaces what was there.

        Raises:
            StoreError: full disk, no permission, connection cut, a device in its place, or a name
                that is no UTF-8; nothing half-written is left.
        """
        if not _is_text(key):
            raise StoreError(f"cannot write {key!a}: the name is no UTF-8; choose another")
        with _one_line(f"cannot write {self.address(key)}"):
            digest = _digest(content)
            self.place.put(key, content)
        return Artifact(key=key, sha256=digest)

    def keep(self, stage: str, name: str, content: bytes | Path) -> Artifact:
        """Put content under a key made of its digest, so that nothing is ever overwritten."""
        with _one_line(f"cannot read {content if isinstance(content, Path) else name}"):
            digest = _digest(content)
        return self.put(f"{stage}/{digest[:16]}/{name}", content)

    def read(self, key: str) -> bytes:
        """The content of a file."""
        with _one_line(f"cannot read {self.address(key)}"):
            return self.place.read(key)

    def sha256(self, key: str) -> str:
        """Digest of a file's content."""
        with _one_line(f"cannot read {self.address(key)}"):
            return self.place.sha256(key)

    def exists(self, key: str) -> bool:
        """Whether there is a file under that key."""
        with _one_line(f"cannot look at {self.address(key)}"):
            return self.place.exists(key)

    def remove(self, key: str) -> None:
        """Take a file away; one that is gone already is no error."""
        with _one_line(f"cannot remove {self.address(key)}"):
            try:
                self.place.remove(key)
            except FileNotFoundError:
                return

    def list(self, prefix: str = "") -> list[str]:
        """Keys under a folder, sorted."""
        with _one_line(f"cannot list {self.address(prefix)}"):
            return sorted(self.place.list(prefix))

    def address(self, key: str) -> str:
        """The path or URL of a key, for people."""
        return self.place.address(key)

    @contextmanager
    def local(self, artifact: Artifact) -> Iterator[Path]:
        """A local file with the content: the file itself on a disk, else a copy that goes away."""
        if isinstance(self.place, Folder):
            yield self.place.root / artifact.key
            return
        with self.scratch() as folder:
            path = folder / artifact.name
            path.write_bytes(self.read(artifact.key))
            yield path

    @contextmanager
    def scratch(self) -> Iterator[Path]:
        """A folder that goes away, for results on their way into the store."""
        base = self.work(SCRATCH)
        with _one_line(f"cannot write {base}"):
            folder = Path(tempfile.mkdtemp(dir=base))
        try:
            with locked(folder, HELD, patience_s=A_MOMENT):  # of a sweep that looks at it
                yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def work(self, name: str) -> Path:
        """A local folder that stays: the state of a run that may be resumed."""
        path = self.here / "work" / name
        with _one_line(f"cannot write {path}"):
            path.mkdir(parents=True, exist_ok=True)
        return path

    @property
    def here(self) -> Path:
        """What belongs to this machine alone: the root itself on a disk, else a folder in cache."""
        if isinstance(self.place, Folder):
            return self.place.root
        cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        return cache / "robojackson" / hashlib.sha256(self.root.encode()).hexdigest()[:12]

    def require_writable(self, room_mb: int = 0) -> None:
        """Raise the one line of a store that is full or refuses a write, before any work.

        Args:
            room_mb: What must be free on the disk of `here`, millions of bytes.
        """
        if room_mb:
            self.require_room(room_mb)
        key = f"{TEMPORARY}{os.getpid()}"
        with _one_line(f"cannot write the store {self.root}"):
            self.place.put(key, b"robojackson " * 1024)
            self.place.remove(key)

    def require_room(self, room_mb: int) -> None:
        """Raise one line where the disk of `here` has less room, millions of bytes."""
        there = next(path for path in (self.here, *self.here.parents) if path.exists())
        with _one_line(f"cannot look at the disk of {self.here}"):
            free_mb = shutil.disk_usage(there).free / 1e6
        if free_mb < room_mb:
            raise StoreError(
                f"the disk of {self.here} has {free_mb:.1f} MB free, {room_mb} MB are needed: "
                f"make room, or let {VARIABLE} name another folder"
            )


def _digest(content: bytes | Path) -> str:
    return sha256_of(content) if isinstance(content, bytes) else sha256_of_file(content)


def _is_text(key: str) -> bool:
    """Whether a name can be told; a file system takes any bytes."""
    try:
        key.encode()
    except UnicodeEncodeError:
        return False
    return True


@contextmanager
def _one_line(what: str) -> Iterator[None]:
    """Turn whatever a place raises into one line."""
    try:
        yield
    except StoreError:
        raise
    except Exception as cause:
        reason = cause.strerror if isinstance(cause, OSError) and cause.strerror else str(cause)
        told = " ".join(reason.split()) or type(cause).__name__
        raise StoreError(f"{what}: {told}") from cause
