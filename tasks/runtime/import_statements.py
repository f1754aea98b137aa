"""What the import statements of a syntax tree name."""

import ast
from collections.abc import Iterator
from typing import TypeGuard


def imported_names(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Yield each imported name and its number of leading dots, imports inside functions included.

    Imports under `if TYPE_CHECKING:` are left out: they do not run, and by those of
    `robojackson/__init__.py` every module would reach the whole library.
    """
    waiting = [tree]
    while waiting:
        node = waiting.pop(0)
        waiting.extend(node.orelse if _is_for_types(node) else ast.iter_child_nodes(node))
        if isinstance(node, ast.Import):
            yield from ((alias.name, 0) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            yield base, node.level
            for alias in node.names:
                yield (f"{base}.{alias.name}" if base else alias.name), node.level


def _is_for_types(node: ast.AST) -> TypeGuard[ast.If]:
    if not isinstance(node, ast.If):
        return False
    name = node.test.attr if isinstance(node.test, ast.Attribute) else node.test
    return "TYPE_CHECKING" in (name, getattr(name, "id", None))


def absolute(name: str, level: int, module: str, is_package: bool) -> str:
    """Return the full name of what a module imports with a number of leading dots."""
    if not level:
        return name
    parts = module.split(".")
    kept = parts[: len(parts) - level + (1 if is_package else 0)]
    return ".".join([*kept, name] if name else kept)
