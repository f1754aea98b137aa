"""The digest of a stage follows its imports and sees formulas, not words."""

from pathlib import Path

import pytest

from tasks.runtime.code_digest import digest, imports_of, reached

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
