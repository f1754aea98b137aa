"""What is in a module's source is found once, by whichever process comes first."""

from pathlib import Path

import pytest

from tasks.runtime.parsed_modules import Parsed, ParsedModules


class Counted:
    """A parser that counts, and its code."""

    def __init__(self, folder: Path) -> None:
        self.recipe, self.calls = folder / "recipe.py", 0
        self.recipe.write_text("first")

    def __call__(self, source: str) -> Parsed:
        self.calls += 1
        return source.upper(), (("numpy", 0), (source, 1))

    def modules(self) -> ParsedModules:
        """Return what another process has."""
        return ParsedModules(self, self.recipe)


@pytest.fixture
def counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Counted:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return Counted(tmp_path)


def kept(folder: Path) -> list[Path]:
    return [path for path in (folder / "cache").rglob("*") if path.is_file()]


def test_another_process_parses_only_what_is_new(counted: Counted, tmp_path: Path) -> None:
    first = counted.modules()
    found = first.of("a")
    first.keep()
    second = counted.modules()
    assert (second.of("a"), counted.calls) == (found, 1)
    assert second.of("b") == ("B", (("numpy", 0), ("b", 1)))
    second.keep()
    third = counted.modules()
    assert [third.of(source)[0] for source in ("a", "b")] == ["A", "B"]
    assert counted.calls == 2
    assert len(kept(tmp_path)) == 1


def test_what_two_processes_find_at_once_is_kept(counted: Counted) -> None:
    one, other = counted.modules(), counted.modules()
    one.of("a")
    other.of("b")
    one.keep()
    other.keep()
    last = counted.modules()
    assert (last.of("a")[0], last.of("b")[0], counted.calls) == ("A", "B", 2)


def test_a_changed_recipe_parses_again(counted: Counted) -> None:
    first = counted.modules()
    first.of("a")
    first.keep()
    counted.recipe.write_text("second")
    counted.modules().of("a")
    assert counted.calls == 2


@pytest.mark.parametrize("text", ["", "{", "[]", '{"a": 1}', '{"a": ["b", [[1]]]}', "[" * 100_000])
def test_a_broken_file_is_parsed_again(text: str, counted: Counted, tmp_path: Path) -> None:
    first = counted.modules()
    first.of("a")
    first.keep()
    (file,) = kept(tmp_path)
    file.write_text(text)
    again = counted.modules()
    assert (again.of("a")[0], counted.calls) == ("A", 2)
    again.keep()
    assert counted.modules().of("a")[0] == "A"
    assert counted.calls == 2


def test_a_cache_that_cannot_be_written_keeps_nothing(counted: Counted, tmp_path: Path) -> None:
    (tmp_path / "cache").write_text("a file")
    modules = counted.modules()
    assert modules.of("a")[0] == "A"
    modules.keep()
    assert modules.of("a")[0] == "A"


def test_a_user_without_a_home_keeps_nothing(
    counted: Counted, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)

    def homeless(path: Path) -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "expanduser", homeless)
    modules = counted.modules()
    assert modules.of("a")[0] == "A"
    modules.keep()
    assert modules.of("a")[0] == "A"
