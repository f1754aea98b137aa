"""Names of dances, setups and runs, as parts of folders, tables and command lines."""

import hashlib
import re
import unicodedata
from os import PathLike
from pathlib import Path

from robojackson.errors import BadConfiguration

NAME_LENGTH = 60


def run_name(text: str) -> str:
    """Return a file's or a person's name as a part of run ids, folders and command lines.

    ASCII letters, digits and `_.-`, never empty, at most `NAME_LENGTH` long; accents are dropped,
    and a name that loses letters or of which nothing is left gets a digest, so that two of them
    stay two.
    """
    plain = unicodedata.normalize("NFKD", text)
    ascii_only = plain.encode("ascii", "ignore").decode()
    name = re.sub(r"[^A-Za-z0-9_.-]+", "-", ascii_only)[:NAME_LENGTH].strip("-._")
    if name and not any(c.isalnum() and not c.isascii() for c in plain):
        return name
    digest = hashlib.sha256(text.encode(errors="replace")).hexdigest()[:8]
    return f"{name[: NAME_LENGTH - 1 - len(digest)] or 'dance'}-{digest}"


def slug_of(name: str) -> str:
    """Return a name in the letters that a key of Prefect may have."""
    return re.sub(r"[^a-z0-9]+", "-", run_name(name).lower()).strip("-")


def run_labels(move: str, setup: str, seed: int | None) -> dict[str, object]:
    """Return the columns by which episodes and evaluations of a run are joined."""
    move, setup = run_name(move), run_name(setup)
    return {"run_id": f"{move}-{setup}-s{seed}", "move": move, "setup": setup, "seed": seed}


def require_run_id(run_id: str) -> str:
    """Return a run id that is given; it names rows of tables and may name files.

    Raises:
        BadConfiguration: it has other letters than `run_name`.
    """
    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,199}", run_id):
        raise BadConfiguration(
            f"run id {run_id[:60]!r}: ASCII letters, digits and _.- alone, as {run_name(run_id)}"
        )
    return run_id


def motion_name(reference: str | PathLike[str]) -> str:
    """Return the name of a reference motion: its folder's where its own name is generic."""
    path = Path(reference).absolute()
    return path.parent.name if path.stem == "reference" else path.stem
