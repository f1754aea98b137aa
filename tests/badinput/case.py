"""A case of the corpus: a command line, the files that it is given, and what must come of it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

Maker = Callable[[Path], object]
"""Makes the files of a case in an empty folder, in which the command then runs."""


def nothing(folder: Path) -> None:
    """Make no file."""


@dataclass(frozen=True)
class Case:
    """One command.

    Attributes:
        group: Kind of foreign input.
        name: What is wrong (or odd), unique in the group.
        words: Words of the command; `@` at the beginning stands for the folder of the base files.
        make: Writer of the files.
        env: Environment variables; `{here}` in a value stands for the folder of the case.
        valid: Whether it must succeed.
        fuzzed: Found by a fuzzer.
        says: Text that the line must contain.
    """

    group: str
    name: str
    words: tuple[str, ...]
    make: Maker = nothing
    env: Mapping[str, str] = field(default_factory=dict)
    valid: bool = False
    says: str = ""


def writes(name: str, content: bytes | str) -> Maker:
    """Return a maker of one file."""
    data = content.encode() if isinstance(content, str) else content

    def make(folder: Path) -> None:
        (folder / name).write_bytes(data)

    return make
