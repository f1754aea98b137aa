"""The roles of the stack's database, on a real PostgreSQL: each may do what it needs, no more."""

import os
import subprocess
from collections.abc import Iterator

import pytest

from tools.stack.compose_stack import Stack

pytestmark = [pytest.mark.cluster, pytest.mark.ci]


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    made = Stack(tmp_path_factory.mktemp("stack"))
    try:
        made.start("postgres")
        yield made
    finally:
        made.down()
        made.remove()


def query(stack: Stack, role: str, sql: str, database: str = "prefect") -> tuple[int, str]:
    names = {"prefect": "POSTGRES_PASSWORD", "backup": "POSTGRES_BACKUP_PASSWORD"}
    access = {"PGPASSWORD": stack.given[names[role]], "PGPORT": str(stack.ports["postgres"])}
    done = subprocess.run(
        ["psql", "-h", "127.0.0.1", "-U", role, "-d", database, "-tAc", sql],
        env={**os.environ, **access}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


def test_the_server_owns_its_tables_and_a_backup_reads_them(stack: Stack) -> None:
    made = query(stack, "prefect", "CREATE TABLE a AS SELECT 1 AS x; CREATE EXTENSION pg_trgm")
    assert made[0] == 0, made[1]
    assert query(stack, "backup", "SELECT x FROM a") == (0, "1\n")


@pytest.mark.parametrize(
    ("role", "sql", "database"),
    [
        ("prefect", "CREATE ROLE evil", "prefect"),
        ("prefect", "CREATE DATABASE evil", "prefect"),
        ("prefect", "COPY (SELECT 1) TO PROGRAM 'true'", "prefect"),
        ("prefect", "SELECT pg_read_file('/etc/passwd')", "prefect"),
        ("prefect", "ALTER ROLE prefect SUPERUSER", "prefect"),
        ("prefect", "SELECT 1", "postgres"),
        ("backup", "CREATE TABLE evil (x int)", "prefect"),
        ("backup", "DELETE FROM a", "prefect"),
        ("backup", "ALTER ROLE backup SUPERUSER", "prefect"),
    ],
)
def test_what_a_role_may_not(stack: Stack, role: str, sql: str, database: str) -> None:
    code, found = query(stack, role, sql, database)
    assert code
    assert "permission denied" in found or "must be" in found
