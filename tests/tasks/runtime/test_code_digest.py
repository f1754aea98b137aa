"""The digest of a stage follows its imports and sees formulas, not words."""

import hashlib
import re
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from tasks.runtime.code_digest import bare_tree, digest, imports_of, reached

ROOT = Path(__file__).parents[3]
MODULES = {
    "__init__.py": '"""A package."""\n__version__ = "1"\n',
    "stage.py": "from science.formula import area\nimport numpy\n",
    "formula.py": (
        '"""Circles."""\n\ndef area(r):\n    """Of a circle."""\n    return 3.14 * r * r\n'
    ),
    "late.py": "def run():\n    from science import inner\n    return inner\n",
    "inner/__init__.py": "from .deep import value\n",
    "inner/deep.py": "value = 1\n",
    "alone.py": "value = 2\n",
    "typed.py": (
        "import typing\n\nif typing.TYPE_CHECKING:\n    from science import alone\n"
        "else:\n    from science import inner\n"
    ),
}


@pytest.fixture
def science(tmp_path: Path) -> Path:
    for name, text in MODULES.items():
        path = tmp_path / "science" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path / "science"


def digest_of(folder: Path, root: str = "science.stage") -> str:
    return digest([root], "science", folder)


def rewrite(folder: Path, name: str, old: str, new: str) -> None:
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new))


def test_imports_are_followed_through_the_package(science: Path) -> None:
    assert reached(["science.stage"], "science", science) == [
        "science",
        "science.formula",
        "science.stage",
    ]


def test_imports_inside_functions_and_relative_ones_are_followed(science: Path) -> None:
    assert reached(["science.late"], "science", science) == [
        "science",
        "science.inner",
        "science.inner.deep",
        "science.late",
    ]


def test_imports_for_type_checkers_alone_are_not_followed(science: Path) -> None:
    found = reached(["science.typed"], "science", science)
    assert found == ["science", "science.inner", "science.inner.deep", "science.typed"]


@pytest.mark.parametrize(
    ("task", "packages"),
    [
        ("download_video", ("mocap", "retarget", "rl", "robot", "report", "api")),
        ("detect_landmarks", ("retarget", "rl", "robot", "report", "api")),
        ("recover_motion", ("retarget", "rl", "robot", "report", "api")),
        ("retarget_motion", ("rl", "report", "api")),
        ("train_policy", ("report",)),
    ],
)
def test_a_later_stage_is_no_part_of_an_earlier_ones_code(
    task: str, packages: tuple[str, ...]
) -> None:
    """A changed reward must not repeat motion capture, nor a changed page a training."""
    roots = imports_of(ROOT / "tasks" / f"{task}.py")
    named = re.findall(r'"(robojackson(?:\.\w+)+)"', (ROOT / f"tasks/{task}.py").read_text())
    modules = reached((*roots, *named), "robojackson", ROOT / "robojackson")
    assert [name for name in modules if name.split(".")[1:2] in [[each] for each in packages]] == []


def test_a_changed_formula_changes_the_digest(science: Path) -> None:
    before = digest_of(science)
    rewrite(science, "formula.py", "3.14", "3.1416")
    assert digest_of(science) != before


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("formula.py", "3.14 * r * r", "3.14 * r * r  # pi r squared"),
        ("formula.py", "Of a circle.", "The area of a circle, m2."),
        ("formula.py", '"""Circles."""', '"""Circles and nothing else."""'),
        ("formula.py", "return 3.14", "\n    return 3.14"),
        ("__init__.py", '"1"', '"2"'),
        ("alone.py", "2", "3"),
    ],
)
def test_words_layout_version_and_strangers_change_nothing(science, name, old, new) -> None:
    before = digest_of(science)
    rewrite(science, name, old, new)
    assert digest_of(science) == before


def test_a_module_that_moved_changes_the_digest(science: Path) -> None:
    before = digest_of(science)
    (science / "formula.py").rename(science / "formulae.py")
    rewrite(science, "stage.py", "science.formula", "science.formulae")
    assert digest_of(science) != before


def test_a_from_import_names_the_module_and_what_may_be_one(science: Path) -> None:
    assert set(imports_of(science / "late.py")) == {"science", "science.inner"}


SAMPLE = """
import math as m, os.path
from . import inner
class Circle(Shape, metaclass=Meta):
    radius: float = 1.0
    async def area(self, /, scale: float = 2e-3, *, unit="µm", **more) -> float:
        return await self.times(m.pi * self.radius**2, f"{scale!r:>{len(unit)}} {unit}" "tail")
try:
    rows = [row for row in table if row] + [*{}, ...]
except* (OSError, ValueError) as error:
    raise RuntimeError(b"\\x00") from error
match rows:
    case {"a": [first, *_], **rest} if rest: print(first, lambda x=1j: -x)
    case _: pass
"""
SAMPLE_SHA256 = "29a0f2b6d98b1c7a515eaf7b755e1b02d080a10f84383276ecf0239dc3eba85c"
"""Of the sample's bare tree: the same on every Python."""
CODE = """
import hashlib, sys
from pathlib import Path
from tasks.runtime.code_digest import bare_tree
total = hashlib.sha256()
for path in sorted(Path("robojackson").rglob("*.py")):
    total.update(bare_tree(path.read_text(encoding="utf-8")).encode())
print(total.hexdigest())
"""
"""The bare trees of the whole library, with nothing but the standard library at hand."""


def pythons() -> list[str]:
    """Return every installed interpreter of another supported version."""
    named = [found for minor in (11, 12, 13) if (found := shutil.which(f"python3.{minor}"))]
    kept = sorted((Path.home() / ".pyenv" / "versions").glob("3.1[123].*/bin/python"))
    versions = {_version(name): name for name in (*named, *map(str, kept))}
    return [versions[each] for each in sorted(versions.keys() - {"", sys.version})]


def _version(python: str) -> str:
    words = [python, "-c", "import sys; print(sys.version, end='')"]
    return subprocess.run(words, capture_output=True, text=True, check=False).stdout


def digest_on(python: str) -> str:
    words = [python, "-c", CODE]
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout


@cache
def digest_here() -> str:
    return digest_on(sys.executable)


@pytest.mark.parametrize(
    ("one", "other"), [('f("")', "f()"), ("[None]", "[]"), ("f'{x:{w}} '", "f'{x:{w}}'")]
)
def test_what_is_empty_counts_where_it_means_something(one: str, other: str) -> None:
    assert bare_tree(one) != bare_tree(other)


def test_the_text_of_a_tree_does_not_depend_on_the_python() -> None:
    assert hashlib.sha256(bare_tree(SAMPLE).encode()).hexdigest() == SAMPLE_SHA256


@pytest.mark.medium
@pytest.mark.parametrize("python", [sys.executable, *pythons()])
def test_the_library_has_one_digest_on_all_pythons(python: str) -> None:
    """The tree of a file is the same text, or a worker with another Python would train again."""
    assert digest_on(python) == digest_here()


@pytest.mark.parametrize("task", ["evaluate_dance", "train_policy", "recover_motion"])
def test_how_values_are_stored_is_no_part_of_what_a_stage_computes(task: str) -> None:
    """The layout of tables is in every key by itself; a lock or an atomic write changes nothing."""
    roots = imports_of(ROOT / "tasks" / f"{task}.py")
    modules = reached(roots, "robojackson", ROOT / "robojackson")
    assert [name for name in modules if name.startswith("robojackson.pipeline")] == []
    assert "robojackson.clips.quality.stability" not in modules


@pytest.mark.parametrize("path", sorted((ROOT / "tasks").glob("*.py")), ids=lambda p: p.stem)
def test_the_modules_that_a_stage_reaches_in_another_process_are_there(path: Path) -> None:
    """A name that is no module would be passed over: the stage would not see its code change."""
    text = path.read_text()
    named = re.findall(r'"(robojackson(?:\.\w+)+)"', text)
    assert [
        n
        for n in named
        if not (ROOT / (n.replace(".", "/") + ".py")).is_file()
        and not (ROOT / n.replace(".", "/") / "__init__.py").is_file()
    ] == []
