"""Every format that a module of this package declares.

A new format is one file beside this one, with `EXPORT`, `IMPORT` or both (see `format`).
"""

import re
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import TypeVar

from robojackson import formats
from robojackson.errors import BadTable, UnknownName
from robojackson.files.foreign_file import refuse_video
from robojackson.formats.format import (
    Content,
    Format,
    Importer,
    PersonExporter,
    PolicyExporter,
    RobotExporter,
)

Kind = TypeVar("Kind", RobotExporter, PersonExporter, PolicyExporter, Importer)
DECLARATIONS = ("EXPORT", "IMPORT")

KNOWN_TO_FAIL: Mapping[bytes, str] = {
    b"": "empty",
    b"PAR1": "a Parquet table; smpl.parquet is what `robojackson retarget` takes",
    b"\x80\x02\x8a\nl\xfc\x9cF\xf9 j\xa8P\x19.": "from before PyTorch 1.6; save it again",
    **dict.fromkeys(
        (b"x\x01", b"x\x5e", b"x\x9c", b"x\xda"),  # zlib; a text may begin with x
        "compressed; write it again with joblib.dump and compress=0",
    ),
    b"\x1f\x8b": "compressed with gzip; unpack it first",
}
"""First bytes of files that cannot be read, and the remedy."""
NUMBERS = re.compile(rb"-?\d[\d.e+-]*([,;\t ]+-?\d[\d.e+-]*){3}")
"""The first row of a table without names."""


def robot_exporters() -> Mapping[str, RobotExporter]:
    """Return the formats of robot motions by name."""
    return _declared(RobotExporter)


def person_exporters() -> Mapping[str, PersonExporter]:
    """Return the formats of human motions by name."""
    return _declared(PersonExporter)


def policy_exporters() -> Mapping[str, PolicyExporter]:
    """Return the formats of policies by name."""
    return _declared(PolicyExporter)


def importers() -> Mapping[str, Importer]:
    """Return the formats of human motions that are read, by name."""
    return _declared(Importer)


def recognise(data: bytes, where: str) -> Importer:
    """Return the importer of a file, by its content; suffixes do not count.

    Raises:
        UnknownName: none of them.
        BadTable: a damaged file, or a pickle that holds anything but arrays.
    """
    for start, cause in KNOWN_TO_FAIL.items():
        if data.startswith(start) and (start or not data):
            raise BadTable(f"{where}: {cause}")
    refuse_video(data, where)
    content = Content(data, where)
    for importer in importers().values():
        if importer.recognises(content):
            return importer
    if content.pickled:
        raise UnknownName("keys of a pickle", ", ".join(content.pickled)[:200], where, importers())
    if NUMBERS.match(data[:256]):
        raise BadTable(
            f"{where}: rows of numbers without names, such as a robot's motion; a person's is read"
        )
    text = " ".join(data[:16].decode("latin1").split())
    shown = text if text.isprintable() else data[:16].hex(" ")
    raise UnknownName("kind of file", shown, where, importers())


@cache
def _formats() -> tuple[Format, ...]:
    """Return the declarations of all modules, by the names of the modules."""
    return tuple(_declarations())


def _declarations() -> Iterator[Format]:
    for module in sorted(iter_modules(formats.__path__), key=lambda found: found.name):
        if not module.ispkg:
            loaded = import_module(f"{formats.__name__}.{module.name}")
            yield from (getattr(loaded, name) for name in DECLARATIONS if hasattr(loaded, name))


def _declared(kind: type[Kind]) -> Mapping[str, Kind]:
    return {each.name: each for each in _formats() if isinstance(each, kind)}
