"""Backup and restore by the compose file's own services: all is destroyed, and all is back."""

import base64
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tools.stack import postgres, seaweed
from tools.stack.compose_stack import QUICK, Stack

pytestmark = [pytest.mark.cluster, pytest.mark.ci, pytest.mark.timeout(900)]
CORE = ("postgres", "s3", "prefect-server", "setup")
RUNS = 3
FILES = {
    "motion/0a/reference.parquet": bytes(range(256)) * 4096,
    "tables/episodes/move=walk/part 0.parquet": b"PAR1",
    "video/ä/dance.mp4": b"",
    "large.bin": b"\x00\xff" * 6_000_000,
}
"""Names with spaces and umlauts, an empty file, and one of several chunks of SeaweedFS (4 MB)."""
READ_ALL = """
import json, sys
from robojackson.files.local_folder import sha256_of
from storage.store import Store
store = Store.from_environment()
found = {key: sha256_of(store.read(key)) for key in store.list()}
json.dump(found, sys.stdout)
"""
FILL = """
import base64, json, sys
from storage.store import Store
store = Store.from_environment()
for key, content in json.load(sys.stdin).items():
    store.put(key, base64.b64decode(content))
"""


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Yield a stack without its workers."""
    made = Stack(tmp_path_factory.mktemp("stack"), more=QUICK)
    try:
        for name in CORE:
            made.start(name)
        yield made
    finally:
        made.down()
        made.remove()


def command(stack: Stack, *words: str, text: str = "") -> str:
    """Run a command beside the stack; return what it prints."""
    run = [sys.executable, *words]
    done = subprocess.run(
        run, env=stack.client(), input=text, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr + done.stdout
    return done.stdout


def fill(stack: Stack) -> None:
    plain = {key: base64.b64encode(content).decode() for key, content in FILES.items()}
    command(stack, "-c", FILL, text=json.dumps(plain))


def digests(stack: Stack) -> dict[str, str]:
    return dict(json.loads(command(stack, "-c", READ_ALL)))


def listed(stack: Stack, *words: str) -> list[dict[str, Any]]:
    """Return what `prefect WORDS` lists, in an order of its own."""
    rows = json.loads(command(stack, "-m", "prefect", *words, "--output", "json"))
    return sorted(rows, key=lambda row: str(row["id"]))


def runs(stack: Stack) -> list[tuple[str, str, Any]]:
    found = listed(stack, "flow-run", "ls", "--state-type", "SCHEDULED", "--limit", "50")
    ours = [row for row in found if not row["auto_scheduled"]]
    return [(row["id"], row["name"], row["parameters"]) for row in ours]


def destroy(stack: Stack) -> None:
    """End everything and delete the data of store and database."""
    stack.down()
    postgres.remove(stack.folder)
    (stack.folder / "postgres.path").unlink()
    shutil.rmtree(stack.folder / "seaweed")
    stack.services.clear()
    seaweed.remove(stack.folder)


def test_what_a_backup_holds_is_back_after_all_was_destroyed(stack: Stack, tmp_path: Path) -> None:
    fill(stack)
    for number in range(RUNS):
        words = ("deployment", "run", "dance/on-demand", "-p", f"source=dance {number}")
        command(stack, "-m", "prefect", *words)
    files, planned = digests(stack), runs(stack)
    deployments = listed(stack, "deployment", "ls")
    assert set(FILES) <= set(files)
    assert len(planned) == RUNS

    made = stack.once("backup", tmp_path)
    assert made.returncode == 0, made.stderr
    again = stack.once("backup", tmp_path)
    assert "0 files, 0.0 MB copied" in again.stdout

    refused = stack.once("restore", tmp_path)
    assert refused.returncode == 1
    assert "is not empty" in refused.stderr

    destroy(stack)
    stack.start("postgres")
    stack.start("s3")
    back = stack.once("restore", tmp_path)
    assert back.returncode == 0, back.stderr
    stack.start("prefect-server")

    assert digests(stack) == files
    assert runs(stack) == planned
    assert listed(stack, "deployment", "ls") == deployments


def test_a_wrong_password_of_the_database_is_one_line(stack: Stack, tmp_path: Path) -> None:
    facts = stack.file["backup"]["environment"]
    name = "PREFECT_SERVER_DATABASE_CONNECTION_URL"
    right = facts[name]
    facts[name] = right.replace(stack.given["POSTGRES_BACKUP_PASSWORD"], "wrong")
    try:
        made = stack.once("backup", tmp_path)
    finally:
        facts[name] = right
    assert made.returncode == 1
    line = made.stderr.strip().splitlines()[-1]
    assert "password authentication failed" in line
    assert "correct the user and password of PREFECT_SERVER_DATABASE_CONNECTION_URL" in line


def test_a_database_in_use_is_not_replaced(stack: Stack, tmp_path: Path) -> None:
    assert stack.once("backup", tmp_path).returncode == 0
    words = stack.file["restore"]["command"]
    stack.file["restore"]["command"] = [*words, "--force"]
    try:
        made = stack.once("restore", tmp_path)
    finally:
        stack.file["restore"]["command"] = words
    assert made.returncode == 1
    assert "stop the Prefect server" in made.stderr


def test_the_backup_role_cannot_write(stack: Stack, tmp_path: Path) -> None:
    roles = stack.file["restore"]["environment"], stack.file["backup"]["environment"]
    assert roles[0]["AWS_ACCESS_KEY_ID"] == "setup"
    assert roles[1]["AWS_ACCESS_KEY_ID"] == "backup"
    given = stack._environment("backup", "intruder")
    words = ("-c", "from storage.store import Store; Store.from_environment().put('x', b'x')")
    run = subprocess.run(
        [sys.executable, *words], env=given, capture_output=True, text=True, check=False
    )
    assert run.returncode != 0
    assert "Access Denied" in run.stderr
