"""The bar of a dance: what it leaves on the terminal."""

import io
import logging
import threading
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from rich.progress import Progress, TaskID

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
    assert "training gets 2.6 min, the pass 6; dances of this length" in result.getvalue()
    assert "512 steps" not in result.getvalue()
    assert not any(isinstance(each, dance_bar._Budget) for each in log.handlers)


def test_a_training_that_ends_while_it_is_looked_at_does_not_end_the_bar(tmp_path: Path) -> None:
    class Store:
        def glob(self, pattern: str) -> list[Path]:
            return [tmp_path / "removed" / "progress.json"]

    given: Any = (Progress(), TaskID(0), 1.0, Store(), threading.Event())
    watch = dance_bar._Watch(*given)
    watch.at("training")
    assert watch._training() == ""
