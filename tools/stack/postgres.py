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


def service(
    settings: Mapping[str, str], check: str, port: int, folder: Path, log: Path, roles: str = ""
) -> Service:
    """Return the database server of a stack.

    Args:
        settings: Environment of the image: POSTGRES_USER, POSTGRES_PASSWORD, POSTGRES_DB.
        check: The file's health check, a line of shell.
        port, folder, log: Where it listens, keeps its data's path, and says what it does.
        roles: SQL that the image runs once, with an empty volume.
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
        ["sh", "-c", _ready(settings, check, roles, home)],
        log,
        user,
    )


def remove(folder: Path) -> None:
    """Remove the data of a stack's database."""
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


def _ready(settings: Mapping[str, str], check: str, roles: str, home: Path) -> str:
    """Return the shell that does what the image does first, then asks for health."""
    if not roles:
        return f"{check} && {_database(settings)}"
    script, done, user = home / "roles.sql", home / "roles.done", settings["POSTGRES_USER"]
    script.write_text(roles)
    command = f"psql -q -v ON_ERROR_STOP=1 -U {user} -d {settings['POSTGRES_DB']} -f {script}"
    return f"pg_isready && {{ test -e {done} || {{ {command} && touch {done}; }}; }} && {check}"


def _database(settings: Mapping[str, str]) -> str:
    """Return the shell that makes the database, as the image does first, and asks it."""
    user, name = settings["POSTGRES_USER"], settings["POSTGRES_DB"]
    query = f"psql -U {user} -d {name} -c 'select 1'"
    return f"{{ {query} 2>/dev/null || createdb -U {user} {name}; {query}; }}"


def _home(folder: Path) -> Path:
    mark = folder / "postgres.path"
    if not mark.exists():
        home = Path(tempfile.mkdtemp(prefix="robojackson-postgres-"))
        if os.geteuid() == 0:
            shutil.chown(home, pwd.getpwnam(USER).pw_name)
        mark.write_text(str(home))
    return Path(mark.read_text())
