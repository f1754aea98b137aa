"""Files get the permissions that the user's umask leaves, and keep those that they have."""

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

from robojackson.files.file_tree import FileTree


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
