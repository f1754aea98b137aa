"""A format is one file of the package: whatever a module declares is offered and recognised."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from robojackson import formats
from robojackson.cli.exporting import names
from robojackson.errors import BadTable, UnknownName
from robojackson.formats import registry
from tests.fixtures.person import person

NEW = """
from robojackson.formats.format import Importer, PersonExporter

EXPORT = PersonExporter("frames", lambda motion: f"frames {len(motion)}".encode())
IMPORT = Importer("frames", bytes, lambda file: file.head.startswith(b"frames"), fps=25.0)
"""


@pytest.fixture
def with_a_new_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Add one more module to the package, as a contributor would."""
    (tmp_path / "frames_format.py").write_text(NEW)
    monkeypatch.setattr(formats, "__path__", [*formats.__path__, str(tmp_path)])
    registry._formats.cache_clear()
    yield
    registry._formats.cache_clear()
    sys.modules.pop("robojackson.formats.frames_format", None)


def test_a_new_file_is_an_exporter(with_a_new_file: None) -> None:
    written = registry.person_exporters()["frames"].write(person())
    assert written == f"frames {len(person())}".encode()


def test_a_new_file_is_in_the_help(with_a_new_file: None) -> None:
    assert any("frames" in line for line in names())


def test_a_new_file_recognises_its_own(with_a_new_file: None) -> None:
    importer = registry.recognise(b"frames 3", "file")
    assert (importer.name, importer.fps) == ("frames", 25.0)


def test_what_an_exporter_writes_is_recognised_by_the_importer_of_its_name() -> None:
    for name in registry.person_exporters().keys() & registry.importers().keys():
        written = registry.person_exporters()[name].write(person())
        assert registry.recognise(written, "file").name == name


def test_no_two_modules_declare_the_same_format() -> None:
    kinds = (registry.robot_exporters, registry.person_exporters, registry.policy_exporters)
    declared = sum(len(kind()) for kind in (*kinds, registry.importers))
    assert declared == len(registry._formats())


def test_rows_of_numbers_are_named_as_such() -> None:
    with pytest.raises(BadTable, match="rows of numbers without names"):
        registry.recognise(b"-0.0720,0.0,0.79,1.0\n", "x.csv")


@pytest.mark.parametrize(
    ("content", "shown"),
    [(b"# a text\n\n", "'# a text'"), (b"\x00\x01binary", "'00 01 62 69 6e 61 72 79'")],
)
def test_an_unknown_file_is_shown_without_control_characters(content: bytes, shown: str) -> None:
    with pytest.raises(UnknownName, match=rf"kind of file {shown} \(x\.bin\)\. Known: "):
        registry.recognise(content, "x.bin")
