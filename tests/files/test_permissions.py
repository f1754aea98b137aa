"""Files get the permissions that the user's umask leaves, and keep those that they have."""

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

from robojackson.errors import BackupFailed, StoreError
from robojackson.files.file_tree import FileTree
from storage.sqlite_database import SQLite
from storage.store import Store
from storage.store_listing import entries


@pytest.fixture
def private() -> Iterator[None]:
    before = os.umask(0o077)
    yield
    os.umask(before)


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.usefixtures("private")
def test_a_private_umask_makes_private_files(tmp_path: Path) -> None:
    FileTree(tmp_path / "out").write("a", b"x")
    assert mode(tmp_path / "out" / "a") == 0o600
    assert mode(tmp_path / "out") == 0o700


def test_a_file_that_is_replaced_keeps_its_permissions(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"x")
    (tmp_path / "a").chmod(0o640)
    FileTree(tmp_path).write("a", b"y")
    assert mode(tmp_path / "a") == 0o640


def test_a_folder_that_may_not_be_read_is_no_empty_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Root may read all folders, so the refusal is made."""
    store, listed = Store(tmp_path / "store"), Path.iterdir
    store.put("runs/a.json", b"{}")

    def refused(self: Path) -> Iterator[Path]:
        if self.name == "runs":
            raise PermissionError(13, "Permission denied", str(self))
        return listed(self)

    monkeypatch.setattr(Path, "iterdir", refused)
    with pytest.raises(StoreError, match=r"cannot list .*: Permission denied: .*runs"):
        store.list("runs")
    with pytest.raises(BackupFailed, match=r"cannot list .*: Permission denied: .*runs"):
        entries(store, SQLite(tmp_path / "absent.db"))
