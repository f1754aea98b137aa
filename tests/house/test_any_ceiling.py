"""`Any` gets rarer: the library's count has a ceiling, which only falls."""

import ast
from pathlib import Path

LIBRARY = Path(__file__).parents[2] / "robojackson"
MOST = 376
"""Lower it when the count has fallen; `object`, a type variable or a dataclass takes its place."""


def names_of_any(path: Path) -> int:
    """Return how often a module writes `Any`, the import of it counted once."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return sum(
        (isinstance(node, ast.Name) and node.id == "Any")
        or (isinstance(node, ast.alias) and node.name == "Any")
        for node in ast.walk(tree)
    )


def test_the_library_names_any_no_more_often_than_it_did() -> None:
    found = sum(names_of_any(path) for path in LIBRARY.rglob("*.py"))
    assert found <= MOST
