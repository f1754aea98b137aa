"""The commands and Python blocks that README, CONTRIBUTING and the pages under docs contain."""

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = (
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "examples" / "README.md",
    *sorted((ROOT / "docs").rglob("*.md")),
)
SHELLS = ("sh", "bash", "console")
FENCE = re.compile(r"(?ms)^ *```(\w*)\n(.*?)^ *```")
INDENTED = re.compile(r"(?m)^ {4}((?:robojackson|python -m|make|pip|prefect) .*)$")
INLINE = re.compile(r"`((?:robojackson|python -m|make|prefect deployment run) [^`]+)`")
ENDED_BY = ("&", "&&", "||", "|", ";", ">")


@dataclass(frozen=True)
class Documented:
    """One command of a page.

    Attributes:
        page: Path from the root.
        words: Program and arguments; leading assignments, comments and what follows a pipe or
            `&&` are left out.
        in_text: Whether it stands in a sentence, where a command may be named without arguments.
    """

    page: str
    words: tuple[str, ...]
    in_text: bool = False

    def __str__(self) -> str:
        return f"{self.page}: {' '.join(self.words)}"


def commands(program: str) -> list[Documented]:
    """Return all documented commands of a program, each once a page."""
    found = {each: None for each in _all() if each.words[0] == program}
    return list(found)


def section(page: str, program: str) -> list[Documented]:
    """Return the commands of the fenced blocks of one page, in their order."""
    text = (ROOT / page).read_text(encoding="utf-8")
    lines = [line for language, block in FENCE.findall(text) for line in _lines(language, block)]
    parsed = (_parsed(page, line) for line in lines)
    return [each for each in parsed if each and each.words[0] == program]


def python_blocks() -> list[tuple[str, str]]:
    """Return (page, code) of every block of Python."""
    return [
        (path.relative_to(ROOT).as_posix(), block)
        for path in PAGES
        for language, block in FENCE.findall(path.read_text(encoding="utf-8"))
        if language == "python"
    ]


def shell_blocks() -> list[tuple[str, str]]:
    """Return (page, code) of every block of shell that shows no output."""
    return [
        (path.relative_to(ROOT).as_posix(), block)
        for path in PAGES
        for language, block in FENCE.findall(path.read_text(encoding="utf-8"))
        if language in ("sh", "bash")
    ]


def _all() -> Iterator[Documented]:
    for path in PAGES:
        text, page = path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix()
        lines = [line for kind, block in FENCE.findall(text) for line in _lines(kind, block)]
        plain = FENCE.sub("", text)
        lines += INDENTED.findall(plain)
        named = [re.sub(r"\s+", " ", line) for line in INLINE.findall(plain)]
        for line in (*lines, *named):
            if (parsed := _parsed(page, line)) is not None:
                yield replace(parsed, in_text=line in named)


def _lines(language: str, block: str) -> list[str]:
    joined = re.sub(r"\\\n\s*", " ", block)
    lines = [line.strip() for line in joined.splitlines()]
    if language == "console":
        return [line.removeprefix("$ ") for line in lines if line.startswith("$ ")]
    if language in SHELLS:
        return lines
    return [line for line in lines if line.startswith(("robojackson ", "python -m "))]


def _parsed(page: str, line: str) -> Documented | None:
    """Return the command of a line; `[--option]` of a usage counts as given, `...` as nothing."""
    usage = re.sub(r"\[(-[^\]]*|[A-Z.]+)\]", r"\1", line)
    try:
        words = shlex.split(usage, comments=True)
    except ValueError:
        return None
    while words and re.match(r"[A-Z_]+=", words[0]):
        words.pop(0)
    ends = [i for i, word in enumerate(words) if word in ENDED_BY or word.endswith(";")]
    words = words[: ends[0]] if ends else words
    words = [word.removesuffix("...") for word in words if word not in ("...", "…")]
    if words[:3] in (["python", "-m", "robojackson"], ["python", "-m", "robojackson.cli"]):
        words[:3] = ["robojackson"]
    if not words:
        return None
    words[0] = words[0].removeprefix(".venv/bin/")
    return Documented(page, tuple(words))
