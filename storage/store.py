"""The store of artifacts: a local folder by default, any fsspec address by configuration.

Keys are relative to the root. Every failure of a place is one `StoreError` with one line.
"""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from robojackson.errors import StoreError
from robojackson.files.file_tree import FileTree, digest_of, in_one_line
from robojackson.files.local_folder import LocalFolder, Place, cache_of
from robojackson.files.places import place_at
from robojackson.pipeline.folder_lock import A_MOMENT, locked
from storage.artifact import Artifact

VARIABLE = "ROBOJACKSON_STORE"
DEFAULT_ROOT = "store"
SCRATCH, HELD = "scratch", ".held"
"""The folder of folders that go away, and the file in each that its process has locked."""


class Store(FileTree):
    """Files by key, under one root.

    Attributes:
        root: Path or URL, as given.
        place: The folder or other place that keeps the files.
    """

    def __init__(self, root: str | Path, place: Place | None = None) -> None:
        with in_one_line(f"cannot open the store {root}"):
            place = place or place_at(str(root))
        super().__init__(root, place)

    @classmethod
    def from_environment(cls) -> "Store":
        """Return the store that `ROBOJACKSON_STORE` names, `./store` without it."""
        return cls(os.environ.get(VARIABLE) or DEFAULT_ROOT)

    def create(self) -> "Store":
        """Return the store itself, its folder or bucket made if it is not there."""
        with in_one_line(f"cannot make the store {self.root}"):
            self.place.create()
        return self

    def put(self, key: str, content: bytes | Path) -> Artifact:
        """Write a file as `write` does; return its key and digest."""
        return Artifact(key=key, sha256=self.write(key, content))

    def verify(self, artifact: Artifact) -> Artifact:
        """Return the artifact itself, if its file is there and unaltered.

        Raises:
            StoreError: the file is gone or has another content.
        """
        found = self.sha256(artifact.key)
        if found != artifact.sha256:
            raise StoreError(
                f"{self.address(artifact.key)} was altered: "
                f"sha256 {found[:12]}..., expected {artifact.sha256[:12]}..."
            )
        return artifact

    def save(self, stage: str, name: str, content: bytes | Path) -> Artifact:
        """Put content under a key made of its digest, so that nothing is ever overwritten."""
        with in_one_line(f"cannot read {content if isinstance(content, Path) else name}"):
            digest = digest_of(content)
        return self.put(f"{stage}/{digest[:16]}/{name}", content)

    @contextmanager
    def local(self, artifact: Artifact) -> Iterator[Path]:
        """Yield a local file with the content: the file itself on a disk, else a temporary copy."""
        if isinstance(self.place, LocalFolder):
            yield self.place.root / artifact.key
            return
        with self.scratch() as folder:
            path = folder / artifact.name
            path.write_bytes(self.read(artifact.key))
            yield path

    @contextmanager
    def scratch(self) -> Iterator[Path]:
        """Yield a temporary folder for results on their way into the store."""
        base = self.work(SCRATCH)
        with in_one_line(f"cannot write {base}"):
            folder = Path(tempfile.mkdtemp(dir=base))
        try:
            with locked(folder, HELD, patience_s=A_MOMENT):  # of a sweep that looks at it
                yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def work(self, name: str) -> Path:
        """Return a local folder that stays: the state of a run that may be resumed."""
        path = self.here / "work" / name
        with in_one_line(f"cannot write {path}"):
            path.mkdir(parents=True, exist_ok=True)
        return path

    @property
    def here(self) -> Path:
        """The folder of this machine: the root itself on a disk, else a folder in cache."""
        if isinstance(self.place, LocalFolder):
            return self.place.root
        return cache_of(self.root)

    def require_writable(self, room_mb: int = 0) -> None:
        """Raise the one line of a store that is full or refuses a write, before any work.

        Args:
            room_mb: What must be free on the disk of `here`, millions of bytes.
        """
        if room_mb:
            self.require_room(room_mb)
        self._try_to_write(f"the store {self.root}")

    def require_room(self, room_mb: int) -> None:
        """Raise one line where the disk of `here` has less room, millions of bytes."""
        there = next(path for path in (self.here, *self.here.parents) if path.exists())
        with in_one_line(f"cannot look at the disk of {self.here}"):
            free_mb = shutil.disk_usage(there).free / 1e6
        if free_mb < room_mb:
            raise StoreError(
                f"the disk of {self.here} has {free_mb:.1f} MB free, {room_mb} MB are needed: "
                f"make room, or let {VARIABLE} name another folder"
            )
