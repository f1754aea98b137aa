"""Limits of length: a module is one concept, a function can be read at once."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("robojackson", "storage", "configs", "tasks", "flows")
MOST_LINES_OF_A_MODULE = 250
MOST_LINES_OF_A_FUNCTION = 60
MODULES = sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))


def functions(path: Path) -> list[ast.FunctionDef | ast.AsyncFunctionDef]:
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return [node for node in nodes if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]


def length(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return the lines from `def` to the end, docstring included, decorators not."""
    return (function.end_lineno or function.lineno) - function.lineno + 1


def test_no_module_is_longer_than_250_lines() -> None:
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in MODULES}
    assert len(lengths) > 250
    found = {path.relative_to(ROOT).as_posix(): lines for path, lines in lengths.items()}
    assert {path: n for path, n in found.items() if n > MOST_LINES_OF_A_MODULE} == {}


@pytest.mark.medium
def test_no_function_is_longer_than_60_lines() -> None:
    found = {
        f"{path.relative_to(ROOT).as_posix()}:{function.name}": length(function)
        for path in MODULES
        for function in functions(path)
    }
    assert {name: n for name, n in found.items() if n > MOST_LINES_OF_A_FUNCTION} == {}
