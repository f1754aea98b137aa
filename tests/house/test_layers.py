"""The rules that hold the house up, read from the imports of every file."""

import ast
import shutil
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LAYERS = ("robojackson", "storage", "configs", "tasks", "flows")
NAMED_ONCE = (*LAYERS, "benchmarks", "tools", "examples")
FOLDERS = (*NAMED_ONCE, "tests")
MOST_FILES = 20
"""In one folder, `__init__.py` not counted."""
COMMANDS = (
    *("flows/cli/commands.py", "flows/cli/search_commands.py", "flows/cli/study_commands.py"),
    *("flows/cli/backup_commands.py", "robojackson/cli/app.py", "robojackson/cli/options.py"),
    *("robojackson/cli/format_commands.py", "robojackson/cli/learning_commands.py"),
    *("robojackson/cli/robot_commands.py", "flows/cli/clean_command.py"),
    *("robojackson/cli/trackers/tracker_commands.py", "flows/cli/gallery_command.py"),
    *("robojackson/cli/pictures/view_command.py", "robojackson/cli/trackers/perform_command.py"),
)
"""Modules that define commands."""
LIGHT = {
    *("typer", "typer.core", "robojackson.errors"),
    *(path.removesuffix(".py").replace("/", ".") for path in COMMANDS),
    "robojackson.cli.console",
}
"""What they may import before the command is known, beside the standard library."""
ALIKE = {"__init__", "__main__"}
"""Names of modules that are the same everywhere."""


def files(*folders: str) -> list[Path]:
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


def imports(path: Path, only_top: bool = False) -> Iterator[str]:
    """Yield the dotted names that a file imports, those for the type checker left out."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = tree.body if only_top else list(ast.walk(tree))
    package = path.relative_to(ROOT).with_suffix("").parts
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            start = ".".join(package[: len(package) - node.level]) if node.level else ""
            yield ".".join(part for part in (start, node.module) if part)


def called(path: Path, only_top: bool = False) -> set[str]:
    """Return the names of the functions that a file calls, or that it calls as it is imported."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    plain = (ast.Assign, ast.AnnAssign, ast.Expr)
    start = [n for n in tree.body if isinstance(n, plain)] if only_top else [tree]
    calls = [n.func for part in start for n in ast.walk(part) if isinstance(n, ast.Call)]
    names = [f.id for f in calls if isinstance(f, ast.Name)]
    return {*names, *(f.attr for f in calls if isinstance(f, ast.Attribute))}


def strings(path: Path) -> Iterator[str]:
    """Yield the texts in a file, docstrings left out."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    silent = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and id(node) not in silent:
            yield from [node.value] if isinstance(node.value, str) else []


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def lint_imports(folder: Path) -> subprocess.CompletedProcess[str]:
    """Check the contracts of pyproject.toml on the packages of a folder."""
    code = "import sys; sys.path.insert(0, '.'); from importlinter.cli import lint_imports_command"
    command = [sys.executable, "-c", f"{code}; lint_imports_command(['--no-cache'])"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_the_imports_keep_the_order() -> None:
    done = lint_imports(ROOT)
    assert done.returncode == 0, done.stdout


@pytest.fixture
def house(tmp_path: Path) -> Path:
    """Return a copy of the packages and of their contracts."""
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for path in files(*LAYERS):
        target = tmp_path / path.relative_to(ROOT)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, target)
    return tmp_path


@pytest.mark.medium
@pytest.mark.parametrize(
    ("path", "line", "broken"),
    [
        ("robojackson/motion/certificate.py", "import robojackson.rl.policy", "inside the library"),
        ("robojackson/formats/bvh.py", "import robojackson.clips.video", "inside the library"),
        ("robojackson/cli/diagnosis/doctor.py", "import flows.dance", "flows decide"),
        ("storage/store.py", "import tasks.study_cell", "flows decide"),
        ("robojackson/rl/policy.py", "import prefect", "know Prefect"),
        ("flows/cli/commands.py", "import prefect", "import it only when they run"),
        ("robojackson/rl/tqc/trainer.py", "import robojackson.rl.tqc.trainers", "no circle"),
    ],
)
def test_an_arrow_up_or_a_circle_is_refused(house: Path, path: str, line: str, broken: str) -> None:
    """Also one that is taken only when a function runs."""
    with (house / path).open("a") as file:
        file.write(f"\n\ndef _planted() -> None:\n    {line}\n")
    done = lint_imports(house)
    assert done.returncode == 1, done.stdout
    assert any(broken in row and "BROKEN" in row for row in done.stdout.splitlines())


@pytest.mark.medium
@pytest.mark.parametrize("layer", ["robojackson", "tasks", "storage"])
def test_no_child_process_hides_an_arrow_up(layer: str) -> None:
    """Processes are started as `python -m robojackson.cli`; no layer names a module above it."""
    above = LAYERS[LAYERS.index(layer) + 1 :]
    hidden = [
        f"{relative(path)}: {text}"
        for path in files(layer)
        for text in strings(path)
        if text.split(".")[0] in above and "." in text and " " not in text
    ]
    assert hidden == []


@pytest.mark.parametrize("path", COMMANDS)
def test_the_command_line_imports_lazily(path: str) -> None:
    heavy = set(imports(ROOT / path, only_top=True)) - LIGHT
    assert {name for name in heavy if name.split(".")[0] not in sys.stdlib_module_names} == set()


def test_modules_have_different_names() -> None:
    names = Counter(path.stem for path in files(*NAMED_ONCE) if path.stem not in ALIKE)
    assert [name for name, count in names.items() if count > 1] == []


def test_no_folder_is_a_heap() -> None:
    heaps = Counter(relative(p.parent) for p in files(*FOLDERS) if p.stem != "__init__")
    assert {folder: count for folder, count in heaps.items() if count > MOST_FILES} == {}


def test_the_project_lists_all_its_packages_by_name() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    listed = set(project["tool"]["setuptools"]["packages"])
    marks = [path for path in files(*LAYERS) if path.stem == "__init__"]
    names = {relative(path.parent).replace("/", ".") for path in marks}
    shipped = {f"robojackson._app.{name}" for name in names if not name.startswith("robojackson")}
    library = {name for name in names if name.startswith("robojackson")}
    assert listed == library | shipped | {"robojackson._app", "robojackson._app.clips"}


def test_no_module_is_called_by_a_word_that_says_nothing() -> None:
    words = {"utils", "util", "helpers", "helper", "common", "misc", "manager"}
    assert [relative(path) for path in files(*LAYERS) if path.stem in words] == []


def test_the_library_prints_nothing() -> None:
    assert [relative(path) for path in files("robojackson") if "print" in called(path)] == []


@pytest.mark.medium
def test_importing_the_library_and_the_layers_beside_it_opens_no_model() -> None:
    """Loading a model or a table at import would make every command slow."""
    opened = {"open", "read_text", "read_bytes", "load_robot", "load"}
    wrong = [relative(p) for p in files("robojackson") if opened & called(p, only_top=True)]
    assert wrong == []
