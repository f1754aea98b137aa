"""`robojackson backup` and `restore`: an answer in the end, one line where it cannot be."""

import json
import os
import re
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flows.cli.commands import app
from storage.store import Store
from tools.stack.service import ROOT

KEY = "motion/0a/reference.parquet"


@pytest.fixture(autouse=True)
def no_server(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("PREFECT_HOME", "PREFECT_API_URL", "PREFECT_SERVER_DATABASE_CONNECTION_URL"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def store(store_folder: Path) -> Store:
    """Return a store with a file and the database of a server in it."""
    made = Store(store_folder)
    made.put(KEY, b"PAR1")
    home = store_folder / "prefect"
    home.mkdir()
    with closing(sqlite3.connect(home / "prefect.db")) as database:
        database.execute("CREATE TABLE runs (n INTEGER)")
    return made


def invoke(*words: object) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, [str(word) for word in words])
    return done.exit_code, done.stdout, done.stderr


def test_a_backup_and_a_restore_are_two_commands(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, out, _ = invoke("backup", tmp_path / "backups", "--json")
    made = json.loads(out)
    assert (code, made["files"], made["copied"]) == (0, 1, 1)
    assert made["database"] == f"{store.root}/prefect/prefect.db"
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "new"))
    code, out, _ = invoke("restore", tmp_path / "backups", "--at", made["name"])
    assert code == 0
    assert "1 files" in out
    assert Store(tmp_path / "new").read(KEY) == b"PAR1"
    assert (tmp_path / "new" / "prefect" / "prefect.db").is_file()


def test_the_older_backups_go_when_fewer_are_kept(store: Store, tmp_path: Path) -> None:
    for _ in range(3):
        assert invoke("backup", tmp_path / "backups", "--keep", 2)[0] == 0
    assert len(list((tmp_path / "backups" / "backups").iterdir())) == 2


def test_the_database_of_prefects_own_home_is_taken(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PREFECT_HOME", str(tmp_path / "home"))
    _, out, _ = invoke("backup", tmp_path / "backups")
    assert f"none at {tmp_path}/home/prefect.db" in out


def test_the_home_of_the_database_may_begin_with_a_tilde(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path / "user"))
    monkeypatch.setenv("PREFECT_HOME", "~/pf")
    (tmp_path / "user").mkdir()
    (Path(store.root) / "prefect").rename(tmp_path / "user" / "pf")
    _, out, _ = invoke("backup", tmp_path / "backups", "--json")
    assert json.loads(out)["database"] == str(tmp_path / "user" / "pf" / "prefect.db")


def test_a_server_whose_database_is_unknown_is_not_left_out_silently(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (Path(store.root) / "prefect" / "prefect.db").unlink()
    monkeypatch.setenv("PREFECT_API_URL", "http://10.0.0.5:4200/api")
    code, _, error = invoke("backup", tmp_path / "backups")
    assert code == 1
    assert "set PREFECT_SERVER_DATABASE_CONNECTION_URL, or unset PREFECT_API_URL" in error
    assert not (tmp_path / "backups").exists()
    monkeypatch.delenv("PREFECT_API_URL")
    assert invoke("backup", tmp_path / "backups")[0] == 0


REFUSED = {
    "a folder without a backup": (["restore", "empty"], 1, "BackupFailed: .*holds no backup"),
    "a folder without a name": (["backup", ""], 2, "the folder's name is empty"),
    "a file": (["backup", "file"], 2, "file is a file; name a folder"),
    "no backup to keep": (
        ["backup", "out", "--keep", "0"],
        2,
        "--keep.*greater than or equal to 1, given '0'",
    ),
    "a folder in the store": (["backup", "store/backups"], 1, "is in the store"),
    "no folder": (["restore"], 2, "Missing argument 'FOLDER'"),
}


@pytest.mark.medium
@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_is_refused_in_one_line(case: str, store: Store, tmp_path: Path) -> None:
    words, expected, reason = REFUSED[case]
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").touch()
    command = [sys.executable, "-m", "robojackson", *words]
    given = {**os.environ, "PYTHONPATH": str(ROOT)}
    run = subprocess.run(
        command, cwd=tmp_path, env=given, capture_output=True, text=True, check=False
    )
    assert (run.returncode, run.stdout) == (expected, "")
    (line,) = run.stderr.splitlines()
    assert re.search(reason, line), line


def test_a_full_disk_is_one_line(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(source: Path, target: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("storage.store_backup.shutil.copyfile", full)
    code, out, error = invoke("backup", tmp_path / "backups")
    assert (code, out) == (1, "")
    assert error.splitlines()[-1].endswith(
        f"cannot copy {store.root}/{KEY}: No space left on device"
    )
