"""The command that `robojackson dance` suggests next."""

import sys

import pytest

from flows.cli import commands
from robojackson.cli.lifetime import interruption


@pytest.fixture(autouse=True)
def typed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["robojackson", "dance", "a.mp4", "--config", "smoke"])


@pytest.mark.parametrize(
    ("kind", "seconds", "message"),
    [
        ("too_short", 0.5, "robojackson dance a.mp4 --config smoke --set evaluate.seconds=10"),
        ("too_short", 10.0, "film or choose a range of at least two seconds (--start, --end)"),
        ("falls", 10.0, "robojackson dance a.mp4 --config smoke --minutes 20"),
        ("dances", 10.0, f"{interruption.python()} -m webbrowser page.html"),
    ],
)
def test_the_next_command_mends_what_was_wrong(kind: str, seconds: float, message: str) -> None:
    assert commands._next(kind, "page.html", 10.0, seconds) == message
