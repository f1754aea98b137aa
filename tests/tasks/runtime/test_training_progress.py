"""A training's bar ends where the training ended, and never stops it."""

import asyncio
import json
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

import pytest
from prefect import artifacts

from tasks.runtime import training_progress

HALF = {"seconds": 30.0, "seconds_left": 30.0, "steps": 500, "steps_per_s": 16.7, "survived_s": 1.5}
WHOLE = {**HALF, "seconds": 60.0, "seconds_left": 0.0, "steps": 1000}


class Page:
    """What stands on Prefect's page."""

    def __init__(self, away: bool = False) -> None:
        self.away = away
        self.updates: list[tuple[float, str]] = []

    async def create(self, progress: float, key: str, description: str) -> UUID:
        if self.away:
            raise ConnectionError("no server")
        self.updates.append((progress, description))
        return uuid4()

    async def update(self, artifact: UUID, progress: float, description: str) -> None:
        self.updates.append((progress, description))


def train(page: Page, work: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Run a training that reports its progress twice."""
    monkeypatch.setattr(artifacts, "acreate_progress_artifact", page.create)
    monkeypatch.setattr(artifacts, "aupdate_progress_artifact", page.update)
    monkeypatch.setattr(training_progress, "EVERY_S", 0.01)

    async def run() -> str:
        async with training_progress.show_progress(work, "scratch-walk-s0"):
            (work / training_progress.FILE).write_text(json.dumps(HALF))
            await asyncio.sleep(0.05)
            (work / training_progress.FILE).write_text(json.dumps(WHOLE))
        return "trained"

    return asyncio.run(run())


def test_the_bar_shows_survival_and_time_left_and_ends_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = Page()
    train(page, tmp_path, monkeypatch)
    half = "scratch-walk-s0: survives 1.50 s, 500 steps, 17 steps/s, 0:30 left"
    assert (50.0, half) in page.updates
    assert page.updates[-1][0] == 100.0


def test_a_server_that_is_away_stops_no_training(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page: Any = Page(away=True)
    assert train(page, tmp_path, monkeypatch) == "trained"
    assert page.updates == []
