"""Debian's PostgreSQL as the compose file's image would be: its user, password and database.

initdb and postgres refuse root, so root starts them as the user postgres, in a folder that this
user can reach.
"""

import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path

from tools.stack.service import Service, StackError

USER = "postgres"


def service(settings: Mapping[str, str], check: str, port: int, folder: Path, log: Path) -> Service:
    """Return the database server of a stack.

    Args:
        settings: Environment of the image: POSTGRES_USER, POSTGRES_PASSWORD, POSTGRES_DB.
        check: The file's health check, a line of shell.
        port, folder, log: Where it listens, keeps its data's path, and writes its log.
    """
    home = _home(folder)
    user = USER if os.geteuid() == 0 else None
    if not (home / "data").exists():
        _initialise(home, settings, user)
    access = {
        "PGPORT": str(port),
        "PGHOST": "127.0.0.1",
        "PGPASSWORD": settings["POSTGRES_PASSWORD"],
    }
    command = [program("postgres"), "-D", str(home / "data"), "-p", str(port), "-h", "127.0.0.1"]
    return Service(
        "postgres",
        [*command, "-k", str(home)],
        {**os.environ, **access},
        ["sh", "-c", f"{check} && {_database(settings)}"],
        log,
        user,
    )


def remove(folder: Path) -> None:
    """Take the data of a stack's database away."""
    if (folder / "postgres.path").exists():
        shutil.rmtree(_home(folder), ignore_errors=True)


def program(name: str) -> str:
    """Return the path of one of PostgreSQL's programs.

    Raises:
        StackError: it is not installed.
    """
    found = sorted(Path("/usr/lib/postgresql").glob(f"*/bin/{name}"))
    if not found:
        raise StackError("PostgreSQL is not installed: apt-get install postgresql")
    return str(found[-1])


def _initialise(home: Path, settings: Mapping[str, str], user: str | None) -> None:
    secret = home / "password"
    secret.write_text(settings["POSTGRES_PASSWORD"])
    if user:
        shutil.chown(secret, user)
    words = ["--username", settings["POSTGRES_USER"], "--pwfile", str(secret)]
    making = [program("initdb"), "-D", str(home / "data"), "-A", "scram-sha-256", *words]
    subprocess.run(making, user=user, check=True, capture_output=True, cwd="/")
    secret.unlink()


def _database(settings: Mapping[str, str]) -> str:
    """Return the shell that makes the database, as the image does at its first start, and asks
    it."""
    user, name = settings["POSTGRES_USER"], settings["POSTGRES_DB"]
    probe = f"psql -U {user} -d {name} -c 'select 1'"
    return f"{{ {probe} 2>/dev/null || createdb -U {user} {name}; {probe}; }}"


def _home(folder: Path) -> Path:
    mark = folder / "postgres.path"
    if not mark.exists():
        home = Path(tempfile.mkdtemp(prefix="robojackson-postgres-"))
        if os.geteuid() == 0:
            shutil.chown(home, pwd.getpwnam(USER).pw_name)
        mark.write_text(str(home))
    return Path(mark.read_text())
