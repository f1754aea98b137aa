"""The rules that hold the house up, read from the imports of every file."""

import ast
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MAY_IMPORT = {
    "robojackson": {"robojackson"},
    "storage": {"robojackson", "storage"},
    "configs": {"robojackson", "configs"},
    "tasks": {"robojackson", "storage", "configs", "tasks"},
    "flows": {"robojackson", "storage", "configs", "tasks", "flows"},
}
LAYERS = tuple(MAY_IMPORT)
MAY_IMPORT_PREFECT = {"tasks", "flows"}
WITHOUT_PREFECT = (
    *("adding", "backups", "bars", "cli", "console", "doctor", "environment", "export", "formats"),
    *("importing", "interruption", "learning", "look", "network", "options", "orphans", "people"),
    *("robots", "scoring", "search", "single", "source", "start", "studies", "supervisor"),
    *("training", "walker"),
)
"""Modules of `flows` that the one-stage commands load."""
LIGHT = {
    *(
        "typer",
        "robojackson.cli.console",
        "robojackson.cli.format_commands",
        "robojackson.cli.learning_commands",
        "robojackson.cli.options",
    ),
    *(
        "flows.cli.backup_commands",
        "robojackson.cli.robot_commands",
        "flows.cli.search_commands",
        "flows.cli.study_commands",
        "robojackson.errors",
    ),
}
"""What the command line may import before it knows the command, beside the standard library."""


def files(*folders: str) -> list[Path]:
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


def imports(path: Path, only_top: bool = False) -> Iterator[str]:
    """Dotted names that a file imports, those for the type checker left out."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = tree.body if only_top else list(ast.walk(tree))
    package = path.relative_to(ROOT).with_suffix("").parts
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            start = ".".join(package[: len(package) - node.level]) if node.level else ""
            yield ".".join(part for part in (start, node.module) if part)


def roots(path: Path) -> set[str]:
    return {name.split(".")[0] for name in imports(path)}


def called(path: Path, only_top: bool = False) -> set[str]:
    """Names of the functions that a file calls, or that it calls as it is imported."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    plain = (ast.Assign, ast.AnnAssign, ast.Expr)
    start = [n for n in tree.body if isinstance(n, plain)] if only_top else [tree]
    calls = [n.func for part in start for n in ast.walk(part) if isinstance(n, ast.Call)]
    names = [f.id for f in calls if isinstance(f, ast.Name)]
    return {*names, *(f.attr for f in calls if isinstance(f, ast.Attribute))}


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def test_a_module_imports_only_what_stands_to_its_left() -> None:
    wrong = []
    for path in files(*LAYERS):
        layer = path.relative_to(ROOT).parts[0]
        ours = {name.split(".")[0] for name in imports(path)} & {*LAYERS, "tests", "tools"}
        wrong += [f"{relative(path)} imports {name}" for name in ours - MAY_IMPORT[layer]]
    assert wrong == []


def test_only_tasks_and_flows_import_prefect() -> None:
    others = files(*set(LAYERS) - MAY_IMPORT_PREFECT)
    assert [relative(path) for path in others if "prefect" in roots(path)] == []


@pytest.mark.parametrize("name", WITHOUT_PREFECT)
def test_what_the_one_stage_commands_load_imports_no_prefect(name: str) -> None:
    assert not roots(ROOT / "flows" / f"{name}.py") & {"prefect", "tasks"}


@pytest.mark.parametrize(
    "name", ["cli", "formats", "learning", "options", "robots", "search", "studies"]
)
def test_the_command_line_imports_lazily(name: str) -> None:
    found = set(imports(ROOT / "flows" / f"{name}.py", only_top=True))
    assert found <= LIGHT | {"os", "pathlib", "typing"}


def test_the_project_lists_all_its_packages_by_name() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    listed = set(project["tool"]["setuptools"]["packages"])
    marks = [path for path in files(*LAYERS) if path.stem == "__init__"]
    assert listed == {relative(path.parent).replace("/", ".") for path in marks}


def test_no_module_is_called_by_a_word_that_says_nothing() -> None:
    words = {"utils", "util", "helpers", "helper", "common", "misc", "manager"}
    assert [relative(path) for path in files(*LAYERS) if path.stem in words] == []


def test_the_library_prints_nothing() -> None:
    assert [relative(path) for path in files("robojackson") if "print" in called(path)] == []


def test_importing_the_library_and_the_layers_beside_it_opens_no_model() -> None:
    """Loading a model or a table at import would make every command slow."""
    opened = {"open", "read_text", "read_bytes", "load_robot", "load"}
    wrong = [relative(p) for p in files("robojackson") if opened & called(p, only_top=True)]
    assert wrong == []
