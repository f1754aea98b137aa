"""Digest of a stage's code: the syntax trees of the modules that it reaches.

Imports are followed statically, also those inside functions. Comments, docstrings and layout are
not in a syntax tree, so they change nothing; a changed formula does.
"""

import ast
import hashlib
import threading
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import import_module, resources
from importlib.util import find_spec
from pathlib import Path

from tasks.runtime.import_statements import absolute, imported_names
from tasks.runtime.parsed_modules import Parsed, ParsedModules

PACKAGE = "robojackson"
ONE_PARSER = threading.Lock()
"""CPython 3.11 counts the depth of its parser wrongly when several threads parse at once."""
NEVER_CHANGE_A_RESULT = frozenset(("robojackson.errors",))
"""Modules whose text decides only what a person reads."""
LAYOUT = (
    "robojackson.files.table_file",
    "robojackson.files.table_types",
    "robojackson.pipeline.table_schemas",
)
"""Modules that define how results are laid out in files."""
NOT_FOLLOWED = frozenset(("robojackson.files", "robojackson.pipeline"))
"""Packages that carry values and files and compute nothing; a change of the layout of tables is in
every key by itself (`layout`)."""
NOT_ON_ALL_PYTHONS = frozenset(("type_params",))
"""Fields of nodes that came with Python 3.12."""


def digest(roots: Iterable[str], package: str = PACKAGE, folder: Path | None = None) -> str:
    """Return the digest of all modules of `package` that the root modules reach.

    Args:
        roots: Dotted names of modules; those outside the package count nothing.
        package: The package whose modules count.
        folder: Where the package is; found by its name when not given.
    """
    key = (tuple(roots), package, folder)
    known = _known.get(key)
    if known is None or not known.holds():
        known = _known[key] = _digested(*key)
    return known.digest


def template_digests(task: str, templates: Iterable[str]) -> list[str]:
    """Return the digests of what makes a page besides the modules that every stage is keyed by.

    Args:
        task: Name of the module of the stage, which puts the page's content together.
        templates: Files of `robojackson.report.pages`.
    """
    here = resources.files(f"{PACKAGE}.report.pages")
    files = [hashlib.sha256(here.joinpath(name).read_bytes()).hexdigest() for name in templates]
    return [digest((task,), task.partition(".")[0]), *files]


@dataclass(frozen=True)
class _Digested:
    """A digest and the versions of the files that it was made of."""

    digest: str
    files: tuple[tuple[Path, int, int], ...]

    def holds(self) -> bool:
        """Return whether no file has changed since; cheap, because a thousand cells check it."""
        try:
            return all(_version(path) == (path, *rest) for path, *rest in self.files)
        except OSError:
            return False


_known: dict[tuple[tuple[str, ...], str, Path | None], _Digested] = {}


def _digested(roots: tuple[str, ...], package: str, folder: Path | None) -> _Digested:
    base = folder or _folder_of(package)
    total = hashlib.sha256()
    files = []
    for name in reached(roots, package, base):
        files.append(_version(_file_of(name, package, base)))
        if name not in NEVER_CHANGE_A_RESULT:
            total.update(f"{name}\0{_parsed(*files[-1])[0]}\0".encode())
    with ONE_PARSER:
        _modules.keep()
    return _Digested(total.hexdigest(), tuple(files))


def reached(roots: Iterable[str], package: str, folder: Path) -> list[str]:
    """Return the modules of a package that are reached from the roots, the roots included,
    sorted."""
    found: set[str] = set()
    seen: set[str] = set()
    waiting = list(roots)
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        if _is_not_followed(name) or not _is_module(name, package, folder):
            continue
        found.add(name)
        waiting.extend(_parents(name))
        waiting.extend(imports_of(_file_of(name, package, folder), name))
    return sorted(found)


def _is_not_followed(name: str) -> bool:
    return any(name == package or name.startswith(f"{package}.") for package in NOT_FOLLOWED)


def imports_of(path: Path, module: str = "") -> tuple[str, ...]:
    """Return every name that a file imports, dotted; `from a import b` gives `a` and `a.b`."""
    names = _parsed(*_version(path))[1]
    is_package = path.name == "__init__.py"
    return tuple(absolute(name, level, module, is_package) for name, level in names)


def file_digest(path: Path) -> str:
    """Return the digest of one file's bare tree, without what it imports."""
    return _parsed(*_version(path))[0]


def bare_tree(source: str) -> str:
    """Return the syntax tree of a source without docstrings and version, as text.

    The text is the same on every Python that we run on, which `ast.dump` is not: fields that are
    empty are left out, and those that some versions lack.
    """
    return _bared(ast.parse(source))


def _bared(tree: ast.AST) -> str:
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [s for s in body if not _is_silent(s)]  # type: ignore[attr-defined]
    return _text(tree)


def _text(value: object) -> str:
    """Return a node, a list of them or a constant as text; a name in no encoding but ASCII."""
    if isinstance(value, list):
        return f"[{', '.join(map(_text, value))}]"
    if not isinstance(value, ast.AST):
        return ascii(value)
    if isinstance(value, ast.JoinedStr):
        value.values = [each for each in value.values if not _is_empty_text(each)]
    fields = ((name, getattr(value, name, None)) for name in value._fields)
    filled = (f"{name}={_text(each)}" for name, each in fields if _counts(name, each))
    return f"{type(value).__name__}({', '.join(filled)})"


def _is_empty_text(value: object) -> bool:
    """Return whether a node is an empty text: Python 3.12.1 ends a nested format with one, others
    do not."""
    return isinstance(value, ast.Constant) and value.value == ""


def _counts(name: str, value: object) -> bool:
    return name not in NOT_ON_ALL_PYTHONS and value is not None and value != []


def _is_silent(statement: ast.stmt) -> bool:
    """Return whether a node is a string that stands alone, or the version: neither is a formula."""
    if isinstance(statement, ast.Expr):
        return isinstance(statement.value, ast.Constant) and isinstance(statement.value.value, str)
    if isinstance(statement, ast.Assign):
        return any(isinstance(t, ast.Name) and t.id == "__version__" for t in statement.targets)
    return False


@lru_cache(maxsize=1024)
def _parsed(path: Path, changed_ns: int, size: int) -> Parsed:
    """Return the digest of a file's bare tree, and its imports; read once a version."""
    source = path.read_text(encoding="utf-8")
    with ONE_PARSER:
        return _modules.of(source)


def _parse(source: str) -> Parsed:
    tree = ast.parse(source)
    names = tuple(imported_names(tree))
    return hashlib.sha256(_bared(tree).encode()).hexdigest(), names


_modules = ParsedModules(_parse, Path(__file__))


def _version(path: Path) -> tuple[Path, int, int]:
    stat = path.stat()
    return path, stat.st_mtime_ns, stat.st_size


def _parents(name: str) -> list[str]:
    parts = name.split(".")
    return [".".join(parts[:i]) for i in range(1, len(parts))]


def _is_module(name: str, package: str, folder: Path) -> bool:
    inside = name == package or name.startswith(f"{package}.")
    return inside and _file_of(name, package, folder).is_file()


def _file_of(name: str, package: str, folder: Path) -> Path:
    inner = name.removeprefix(package).strip(".").replace(".", "/")
    path = folder / inner if inner else folder
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def _folder_of(package: str) -> Path:
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError(package)
    return Path(spec.origin).parent


@cache
def layout() -> str:
    """Return the digest of the layout of result files: a table of an older layout could not be
    read."""
    files = [Path(str(import_module(name).__file__)) for name in LAYOUT]
    return hashlib.sha256("".join(bare_tree(f.read_text()) for f in files).encode()).hexdigest()
