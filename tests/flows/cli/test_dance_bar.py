"""The bar of a dance: what it leaves on the terminal."""

import io
import logging
from pathlib import Path

import pytest
from rich.console import Console

from flows.cli import dance_bar
from tasks.train_policy import BUDGET


def test_on_a_terminal_it_says_what_training_gets_and_no_other_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = io.StringIO()
    terminal = Console(file=result, force_terminal=True, width=100)
    monkeypatch.setattr(dance_bar, "Console", lambda **_: terminal)
    log = logging.getLogger(dance_bar.TASK_LOG)
    monkeypatch.setattr(log, "level", logging.INFO)
    monkeypatch.setattr(log, "propagate", False)
    with dance_bar.dance_bar(6.0, tmp_path):
        log.info(BUDGET, 2.6, 6.0, 10.0)
        log.info("%d steps", 512)
    assert "training gets 2.6 of 6 min; dances of this length need about 10" in result.getvalue()
    assert "512 steps" not in result.getvalue()
    assert not any(isinstance(each, dance_bar._Budget) for each in log.handlers)
