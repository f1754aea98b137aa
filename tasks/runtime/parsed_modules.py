"""What was found in the sources of modules, kept in the user's cache: parsing takes seconds."""

import json
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from robojackson.files.local_folder import LocalFolder, sha256_of, sha256_of_file, user_cache

Parsed = tuple[str, tuple[tuple[str, int], ...]]
"""Digest of a source, and its imports as (name, level)."""
MOST = 4000
"""Sources of a file: a few versions of the library."""


class ParsedModules:
    """What this process and earlier ones found, by the text of the source.

    A folder that cannot be written keeps nothing, a user without a home neither, and a broken file
    holds nothing.
    """

    def __init__(self, parse: Callable[[str], Parsed], recipe: Path) -> None:
        """Args: `parse` finds it, by the code of the file `recipe`."""
        self._parse, self._recipe = parse, recipe
        self._found: dict[str, Parsed] | None = None
        self._is_new = False

    def of(self, source: str) -> Parsed:
        """Return what is in a source, parsed only where it was not before."""
        if self._found is None:
            self._found = self._kept()
        key = sha256_of(source.encode())
        if key not in self._found:
            self._found[key] = self._parse(source)
            self._is_new = True
        return self._found[key]

    def keep(self) -> None:
        """Write what is new, and what others have written meanwhile."""
        if not self._is_new or self._found is None:
            return
        self._is_new = False
        both = {**self._kept(), **self._found}
        rows = dict(list(both.items())[-MOST:])
        with suppress(OSError, RuntimeError):
            file = self._file()
            file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            LocalFolder(file.parent).put(file.name, json.dumps(rows).encode())

    def _kept(self) -> dict[str, Parsed]:
        try:
            return _read(self._file())
        except RuntimeError:  # a user without a home
            return {}

    def _file(self) -> Path:
        recipe = sha256_of_file(self._recipe)
        return user_cache() / "parsed" / f"{recipe[:12]}.json"


def _read(file: Path) -> dict[str, Parsed]:
    try:
        rows = json.loads(file.read_bytes())
        return {
            str(key): (str(digest), tuple((str(name), int(level)) for name, level in names))
            for key, (digest, names) in rows.items()
        }
    except (OSError, ValueError, TypeError, AttributeError, RecursionError):
        return {}
