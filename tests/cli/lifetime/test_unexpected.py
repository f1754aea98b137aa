"""Lines for what no command foresees."""

import importlib
import sys
from pathlib import Path

import pytest
import typer

from robojackson.cli.lifetime.unexpected import require_finite, unexpected


def caught(call) -> Exception:
    try:
        call()
    except Exception as cause:
        return cause
    raise AssertionError("nothing was raised")


@pytest.fixture
def library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Make a library that reads a variable when it is loaded, and one that fails later."""
    folder = tmp_path / "site-packages" / "choosy"
    folder.mkdir(parents=True)
    (folder / "__init__.py").write_text("from choosy.settings import CHOICE\n")
    (folder / "settings.py").write_text("CHOICE = int('junk')\n")
    (folder.parent / "late.py").write_text("def fail():\n    return int('junk')\n")
    monkeypatch.syspath_prepend(str(folder.parent))
    monkeypatch.delitem(sys.modules, "late", raising=False)
    return "choosy"


def test_a_library_that_cannot_be_loaded_is_named(library: str) -> None:
    line = unexpected(caught(lambda: exec(f"import {library}")))
    assert line.startswith("BadConfiguration: choosy cannot be loaded: ValueError: ")
    assert line.endswith("look at the environment variables that it reads")


def test_an_error_after_a_library_was_loaded_is_a_bug(library: str) -> None:
    late = importlib.import_module("late")
    assert unexpected(caught(late.fail)).startswith("InternalError: ValueError: ")


def test_an_error_of_our_own_is_a_bug() -> None:
    line = unexpected(caught(lambda: require_finite(None)))  # type: ignore[arg-type]
    assert line.startswith("InternalError: AttributeError: ")


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_numbers_of_options_are_finite(value: float) -> None:
    with pytest.raises(typer.BadParameter, match=r"--older-than is .*, expected a finite number"):
        require_finite({"older_than": value, "name": "x", "count": 3})
    require_finite({"older_than": 3.0, "as_json": True, "none": None})
