"""Docstrings, comments, messages and documents use standard words; docstrings begin with a verb.

Helpers of tests begin with a verb as well, by convention; no test requires it of them.
"""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.house.test_documents import documents

ROOT = Path(__file__).parents[2]
FOLDERS = ("robojackson", "flows", "tasks", "storage", "configs", "tests", "benchmarks", "tools")
PRIVATE = {
    "told": "reported, logged, named",
    "tells": "reports, shows, names",
    "anew": "again",
    "asked": "requested",
    "judged": "evaluated (a policy), assessed (a video)",
    "nobody": "no person, no process",
    "once more": "again",
    "hunt": "search",
    "lap": "cycle",
}
"""Words that this house once used in a sense of its own, with the standard ones."""
WORDS = re.compile(rf"(?i)\b(?:{'|'.join(PRIVATE)})\b")
NOUNS = "A|An|The|Its|Their|Of|What|Whether|Where|Which|Who|Whose|How|One|Two|Three|Every|Each"
DOCSTRING = re.compile(rf'^( +)r?"""(?:{NOUNS})\b')
OLD = {"docs/renames.md", "THIRD_PARTY.md"}
"""Old names, and licences by others."""


def sources(folder: str) -> Iterator[tuple[str, str]]:
    """Yield (path, text) of the Python files of a folder, without this one and its samples."""
    for path in sorted((ROOT / folder).rglob("*.py")):
        if path != Path(__file__):
            yield path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")


def private_words(text: str) -> list[str]:
    """Return the private words in a text, quoted code left out."""
    return WORDS.findall(re.sub(r"`[^`]*`", "", text))


def prose(source: str) -> Iterator[tuple[int, str]]:
    """Yield (line, text) of every docstring, comment and message of an error in Python code."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            yield getattr(node, "lineno", 1), ast.get_docstring(node) or ""
        if isinstance(node, ast.Raise):
            for part in ast.walk(node):
                if isinstance(part, ast.Constant) and isinstance(part.value, str):
                    yield part.lineno, part.value
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def verbless(source: str) -> list[tuple[int, str]]:
    """Return (line, name) of functions whose docstring begins with a noun phrase.

    Properties may: they are named like data. So may tests, whose docstring says why the law holds.
    """
    lines = source.splitlines()
    found = []
    for at, line in enumerate(lines):
        if not (docstring := DOCSTRING.match(line)) or not lines[at - 1].endswith(":"):
            continue
        outer = docstring.group(1)[4:]
        start = next(i for i in range(at - 1, -1, -1) if re.match(rf"{outer}[a-z]", lines[i]))
        name = re.match(r" *(?:async )?def (\w+)", lines[start])
        is_property = "property" in lines[start - 1]
        if name and not name.group(1).startswith("test_") and not is_property:
            found.append((start + 1, name.group(1)))
    return found


@pytest.mark.parametrize("folder", FOLDERS)
def test_the_words_of_the_code_are_standard(folder: str) -> None:
    found = [
        f"{path}:{line}: {word!r}: {PRIVATE[word.lower()]}"
        for path, text in sources(folder)
        if private_words(text)
        for line, part in prose(text)
        for word in private_words(part)
    ]
    assert found == []


@pytest.mark.parametrize("folder", [folder for folder in FOLDERS if folder != "tests"])
def test_docstrings_of_functions_begin_with_a_verb(folder: str) -> None:
    found = [f"{path}:{line}: {n}" for path, text in sources(folder) for line, n in verbless(text)]
    assert found == []


def test_the_words_of_the_documents_are_standard() -> None:
    pages = [path for path in documents() if path.relative_to(ROOT).as_posix() not in OLD]
    found = [
        f"{path.relative_to(ROOT)}: {word!r}: {PRIVATE[word.lower()]}"
        for path in pages
        for word in private_words(path.read_text(encoding="utf-8"))
    ]
    assert found == []


def test_private_words_are_found() -> None:
    source = 'def f():\n    """The rows, judged once more."""\n    raise E("asked")  # told\n'
    words = [(line, word) for line, text in prose(source) for word in private_words(text)]
    assert words == [(1, "judged"), (1, "once more"), (3, "asked"), (3, "told")]
    assert private_words("`told`, untold") == []


def test_docstrings_without_a_verb_are_found() -> None:
    long = "async def g(\n    a: int,\n) -> int:\n    " + '"""The sum."""\n'
    held = 'class A:\n    """The A."""\n\n    @property\n    def b(self):\n        """The b."""\n'
    assert verbless('def f():\n    """What is there."""\n') == [(1, "f")]
    assert verbless(long) == [(1, "g")]
    assert verbless(held + 'def test_a():\n    """The law."""\n') == []
