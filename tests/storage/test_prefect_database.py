"""Which database a server uses, and PostgreSQL's programs: their failures are one clear line."""

import os
import stat
from pathlib import Path

import pytest

from robojackson.errors import BackupFailed, MissingDependency
from storage.postgresql_database import PostgreSQL
from storage.prefect_database import VARIABLES, database_of
from storage.sqlite_database import SQLite

URL = "postgresql+asyncpg://prefect:p%40ss@db.example:5433/runs"
MISMATCH = """pg_dump: error: aborting because of server version mismatch
pg_dump: detail: server version: 17.2; pg_dump version: 15.18"""
FAILURES = {
    MISMATCH: r"server version: 17.2; pg_dump version: 15.18; install the postgresql-client",
    'FATAL:  password authentication failed for user "prefect"': (
        r'failed for user "prefect"; correct the user and password of PREFECT_SERVER_DATABASE'
    ),
    "connection to server failed: Connection refused": r"db.example:5433/runs: .* refused",
    "": "exit code 1",
}


@pytest.fixture
def programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder that is the only one on PATH."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))
    return folder


def program(folder: Path, name: str, body: str) -> None:
    path = folder / name
    path.write_text(f"#!/bin/sh\n{body}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)


def test_the_url_of_sqlalchemy_becomes_what_postgresql_reads() -> None:
    found = PostgreSQL.of(URL)
    expected = {"PGHOST": "db.example", "PGPORT": "5433", "PGUSER": "prefect"}
    assert expected.items() <= found.access.items()
    assert (found.access["PGPASSWORD"], found.access["PGDATABASE"]) == ("p@ss", "runs")


def test_a_socket_and_encryption_are_options_of_the_url() -> None:
    found = PostgreSQL.of("postgresql+asyncpg://me@/runs?host=/run/postgresql&ssl=require")
    assert (found.access["PGHOST"], found.access["PGSSLMODE"]) == ("/run/postgresql", "require")


def test_the_password_is_in_no_command_line_and_no_text(programs: Path, tmp_path: Path) -> None:
    for name in ("pg_dump", "pg_restore"):
        program(
            programs, name, f'echo "$@" >> {tmp_path}/words; echo "$PGPASSWORD" > {tmp_path}/env'
        )
    program(programs, "psql", f'echo "$@" >> {tmp_path}/words; echo 0')
    database = PostgreSQL.of(URL)
    database.dump(tmp_path / "dump")
    database.load(tmp_path / "dump")
    assert database.is_empty()
    assert (tmp_path / "env").read_text().strip() == "p@ss"
    assert "p@ss" not in (tmp_path / "words").read_text() + repr(database) + database.address


@pytest.mark.parametrize("name", ["pg_dump", "pg_restore", "psql"])
def test_a_program_that_is_missing_is_named_with_its_package(name: str, programs: Path) -> None:
    calls = {
        "pg_dump": lambda d: d.dump(Path("x")),
        "pg_restore": lambda d: d.require_readable(Path("x")),
        "psql": lambda d: d.is_empty(),
    }
    with pytest.raises(MissingDependency, match=f"{name} .*apt-get install postgresql-client"):
        calls[name](PostgreSQL.of(URL))


@pytest.mark.parametrize("message", FAILURES)
def test_a_failure_is_one_line_with_the_next_step(message: str, programs: Path) -> None:
    program(programs, "pg_dump", f"echo '{message}' >&2; exit 1")
    with pytest.raises(BackupFailed, match=FAILURES[message]) as failed:
        PostgreSQL.of(URL).dump(Path("x"))
    assert "\n" not in str(failed.value)


def test_a_database_that_others_use_is_not_replaced(programs: Path, tmp_path: Path) -> None:
    program(programs, "psql", "echo 3")
    program(programs, "pg_restore", f"touch {tmp_path}/loaded")
    with pytest.raises(BackupFailed, match=r"3 connections .* stop the Prefect server"):
        PostgreSQL.of(URL).load(tmp_path / "dump")
    assert not (tmp_path / "loaded").exists()


def no_home() -> Path:
    """Stand for the home of a user who has none."""
    raise RuntimeError("Could not determine home directory.")


@pytest.mark.parametrize("name", VARIABLES)
def test_a_variable_names_the_database(name: str, tmp_path: Path) -> None:
    assert database_of({name: URL}, no_home) == PostgreSQL.of(URL)
    file = {name: f"sqlite+aiosqlite:///{tmp_path}/my%20runs.db"}
    assert database_of(file, no_home) == SQLite(tmp_path / "my runs.db")


def test_without_a_variable_it_is_the_file_in_prefects_home(tmp_path: Path) -> None:
    assert database_of({}, lambda: tmp_path) == SQLite(tmp_path / "prefect.db")


@pytest.mark.parametrize("url", ["sqlite+aiosqlite:///:memory:", "mysql://u:secret@h/db", "x"])
def test_a_database_that_cannot_be_copied_is_refused_without_its_password(url: str) -> None:
    with pytest.raises(BackupFailed, match="names no database that can be copied") as failed:
        database_of({VARIABLES[0]: url}, no_home)
    assert "secret" not in str(failed.value)


@pytest.mark.parametrize("password", ["sec/ret", "sec#ret", "sec?ret", "[secret"])
def test_a_password_that_breaks_its_address_is_one_line_with_what_to_write(
    password: str, tmp_path: Path
) -> None:
    with pytest.raises(BackupFailed, match=r"CONNECTION_URL is no address .* / as %2F") as failed:
        database_of({VARIABLES[0]: f"postgresql+asyncpg://u:{password}@h:5432/db"}, no_home)
    assert "sec" not in str(failed.value)


def test_an_empty_variable_names_nothing(tmp_path: Path) -> None:
    assert database_of({VARIABLES[0]: "", **os.environ}, lambda: tmp_path).kind == "sqlite"
