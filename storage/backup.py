"""A folder of backups: every content once, under its digest, and one manifest a backup.

    contents/3f/3fa9...             bytes of a file of the store, or of a dump of the database
    backups/20261123T013405Z.json   what a backup consists of: key -> digest, size

A content is written under a temporary name, synced and renamed; the manifest comes last. So an
interrupted backup changes no earlier one, and the next one continues where it ended.
"""

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter, ValidationError

from robojackson.config import config_dataclass
from robojackson.errors import BackupFailed, StoreError
from robojackson.files.foreign_file import parse_json, read_text
from robojackson.files.local_folder import TEMPORARY, LocalFolder, sha256_of, sha256_of_file
from robojackson.pipeline.folder_lock import locked

CONTENTS, MANIFESTS = "contents", "backups"
HELD = ".writing"
"""The file that is locked while a backup is written."""


@config_dataclass
class Content:
    """Bytes in a folder of backups.

    Attributes:
        sha256: Digest, 64 hexadecimal digits.
        size: Bytes.
        stamp: What the store reports of the file as long as it is unchanged; None: unknown.
    """

    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    size: Annotated[int, Field(ge=0)]
    stamp: str | None = None


@config_dataclass
class Dump:
    """A copy of Prefect's database.

    Attributes:
        kind: Which database it is of, and so how it is read back.
        content: The dump itself.
    """

    kind: Literal["postgresql", "sqlite"]
    content: Content


@config_dataclass
class Manifest:
    """One backup.

    Attributes:
        store: Address of the store.
        files: Content of each key of the store.
        database: Prefect's database; None: there was none.
        version: Version of this layout.
    """

    store: str
    files: dict[str, Content]
    database: Dump | None
    version: Literal[1] = 1

    def contents(self) -> dict[str, Content]:
        """Return what the backup consists of, by digest."""
        dump = [self.database.content] if self.database else []
        return {content.sha256: content for content in (*self.files.values(), *dump)}


MANIFEST = TypeAdapter(Manifest)


class Backups:
    """The backups in a folder.

    Attributes:
        root: The folder.
    """

    def __init__(self, root: Path) -> None:
        self.root = root.absolute()

    def names(self) -> list[str]:
        """Return the names of all backups, the oldest first."""
        return sorted(path.stem for path in (self.root / MANIFESTS).glob("[!.]*.json"))

    def read(self, name: str | None = None) -> Manifest:
        """Return the manifest of a backup, the newest without a name.

        Raises:
            BackupFailed: there is no backup, or its manifest is damaged.
        """
        names = self.names()
        if not names:
            raise BackupFailed(f"{self.root} holds no backup; `robojackson backup` makes one")
        if name is not None and name not in names:
            raise BackupFailed(f"{self.root} holds no backup {name!r}. Backups: {', '.join(names)}")
        path = self.root / MANIFESTS / f"{name or names[-1]}.json"
        try:
            return _parsed(read_text(path, BackupFailed))
        except (BackupFailed, ValueError, KeyError, TypeError) as cause:
            others = ", ".join(other for other in names if other != path.stem) or "none"
            raise BackupFailed(
                f"{path} is damaged: {_reason(cause)}. Other backups (--at): {others}"
            ) from cause

    def write(self, manifest: Manifest) -> str:
        """Add a backup whose contents are all in the folder; return its name."""
        plain = MANIFEST.dump_python(manifest, mode="json")
        text = json.dumps({"sha256": _digest(plain), "backup": plain}, indent=1)
        name = self._new_name()
        LocalFolder(self.root).put(f"{MANIFESTS}/{name}.json", text.encode())
        return name

    def path(self, content: Content) -> Path:
        """Return the place of a content."""
        return self.root / CONTENTS / content.sha256[:2] / content.sha256

    def has(self, content: Content) -> bool:
        """Return whether a content of that digest and size is in the folder."""
        path = self.path(content)
        return path.is_file() and path.stat().st_size == content.size

    def add(self, path: Path, stamp: str | None = None) -> Content:
        """Move a file of `temporary` to its place, over one of its digest, which may be damaged."""
        content = Content(sha256_of_file(path), path.stat().st_size, stamp)
        target = self.path(content)
        target.parent.mkdir(parents=True, exist_ok=True)
        with path.open("rb") as file:
            os.fsync(file.fileno())
        os.replace(path, target)
        return content

    def require_whole(self, content: Content, what: str) -> None:
        """Raise when a content is not what its digest promises.

        Raises:
            BackupFailed: it is missing, truncated or altered.
        """
        path = self.path(content)
        if not path.is_file():
            raise BackupFailed(f"{what}: {path} is missing from the backup")
        size = path.stat().st_size
        if size != content.size:
            raise BackupFailed(
                f"{what}: {path} is truncated or altered: {size:,} bytes, expected {content.size:,}"
            )
        found = sha256_of_file(path)
        if found != content.sha256:
            raise BackupFailed(f"{what}: {path} is altered: its sha256 is {found[:12]}...")

    @contextmanager
    def temporary(self) -> Iterator[Path]:
        """Yield a path in the folder for content on its way; what is left there is removed."""
        folder = self.root / CONTENTS
        folder.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=TEMPORARY, dir=folder)
        os.close(handle)
        try:
            yield Path(name)
        finally:
            Path(name).unlink(missing_ok=True)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Hold the folder for one backup, without what an interrupted one left half-written.

        Raises:
            BackupFailed: another backup is being written there.
        """
        self.root.mkdir(parents=True, exist_ok=True)
        try:
            hold = locked(self.root, HELD)
            hold.__enter__()
        except StoreError as cause:
            raise BackupFailed(f"another backup is being written to {self.root}") from cause
        try:
            for path in self.root.rglob(f"{TEMPORARY}*"):
                path.unlink(missing_ok=True)
            yield
        finally:
            hold.__exit__(None, None, None)

    def prune(self, keep: int) -> int:
        """Remove all backups but the newest ones, and contents that none of these has.

        Contents stay while a manifest is damaged. Return the number of freed bytes.
        """
        names = self.names()
        for name in names[: max(len(names) - keep, 0)]:
            (self.root / MANIFESTS / f"{name}.json").unlink(missing_ok=True)
        try:
            needed = {sha256 for name in self.names() for sha256 in self.read(name).contents()}
        except BackupFailed:
            return 0
        unneeded = [p for p in (self.root / CONTENTS).glob("*/*") if p.name not in needed]
        freed = sum(path.stat().st_size for path in unneeded)
        for path in unneeded:
            path.unlink()
        return freed

    def _new_name(self) -> str:
        """Return the time in UTC, which no backup has as its name yet."""
        name = datetime.now(UTC).strftime("%Y%m%dT%H%M%S.%fZ")
        last = (self.names() or [""])[-1]
        return name if name > last else f"{last}+"  # a clock that was set back


def _parsed(text: str) -> Manifest:
    """Return a manifest whose digest and keys are right.

    Raises:
        ValueError, KeyError, TypeError: it is truncated, altered, or of another layout.
    """
    whole = parse_json(text)
    if whole["sha256"] != _digest(whole["backup"]):
        raise ValueError("its content does not have the digest that it names")
    manifest: Manifest = MANIFEST.validate_python(whole["backup"])
    for key in manifest.files:
        parts = PurePosixPath(key).parts
        if not parts or {"..", "\0"} & {*parts, *key} or PurePosixPath(key).is_absolute():
            raise ValueError(f"{key!r} is no key of a store")
    return manifest


def _digest(plain: Any) -> str:
    return sha256_of(json.dumps(plain, sort_keys=True).encode())


def _reason(cause: Exception) -> str:
    if isinstance(cause, ValidationError):
        first = cause.errors()[0]
        return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
    return f"no {cause}" if isinstance(cause, KeyError) else str(getattr(cause, "reason", cause))
