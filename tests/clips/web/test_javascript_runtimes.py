"""Which JavaScript runtime yt-dlp is given: one that is here and new enough."""

from pathlib import Path

import pytest

from robojackson.clips.web import javascript_runtimes


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Return install(program, words), which adds a program that prints its version; there is no
    other."""
    monkeypatch.setattr(javascript_runtimes.sys, "executable", str(tmp_path / "python"))
    monkeypatch.setattr(javascript_runtimes.shutil, "which", lambda name: None)

    def make(program: str, words: str) -> None:
        path = tmp_path / program
        path.write_text(f"#!/bin/sh\necho '{words}'\n")
        path.chmod(0o755)

    return make


def test_without_any_there_is_none(install) -> None:
    assert (javascript_runtimes.runtimes(), javascript_runtimes.usable()) == ({}, None)


def test_one_beside_python_is_found(install, tmp_path: Path) -> None:
    install("deno", "deno 2.9.8 (stable, release)")
    assert javascript_runtimes.runtimes() == {"deno": str(tmp_path / "deno")}
    assert javascript_runtimes.usable() == "deno"


def test_an_old_one_is_passed_over_for_a_new_one(install) -> None:
    install("deno", "deno 1.46.3")
    install("node", "v22.4.1")
    assert javascript_runtimes.usable() == "node"


def test_one_that_is_too_old_does_not_count(install) -> None:
    install("node", "v18.20.4")
    assert javascript_runtimes.usable() is None


def test_quickjs_is_known_by_its_program(install) -> None:
    install("qjs", "")
    assert javascript_runtimes.usable() == "quickjs"
