"""A training's progress on Prefect's pages: a bar with survival, speed and the time left."""

import asyncio
import json
import re
import time
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any
from uuid import UUID

FILE = "progress.json"
"""What a training keeps writing into its folder."""
EVERY_S, LATER_S, SHARE = 5.0, 30.0, 0.05
"""Between two looks at it, seconds: at first, at last, and as a share of the time it has lasted."""


@asynccontextmanager
async def show_progress(work: Path, name: str) -> AsyncIterator[None]:
    """Show the progress of a training in `work` for the time of a block, and where it ended."""
    bar = _Bar(work / FILE, name)
    watcher = asyncio.create_task(bar.watch())
    try:
        yield
    finally:
        watcher.cancel()
        with suppress(asyncio.CancelledError):
            await watcher
    await bar.publish()


class _Bar:
    """A training's bar: no server and no file are reasons to show nothing, never to stop it."""

    def __init__(self, path: Path, name: str) -> None:
        self._path, self._name = path, name
        self._artifact: UUID | None = None

    async def watch(self) -> None:
        from prefect.artifacts import acreate_progress_artifact

        key = re.sub(r"[^a-z0-9]+", "-", self._name.lower()).strip("-")
        text = f"{self._name}: starting"
        with suppress(Exception):
            self._artifact = await acreate_progress_artifact(0.0, key=key, description=text)
        began = time.monotonic()
        while self._artifact is not None:
            lasted = time.monotonic() - began
            await asyncio.sleep(min(max(EVERY_S, SHARE * lasted), LATER_S))
            await self.publish()

    async def publish(self) -> None:
        """Publish what the file contains now."""
        from prefect.artifacts import aupdate_progress_artifact

        with suppress(Exception):
            row = json.loads(self._path.read_text())
            if self._artifact is not None:
                said = format_row(self._name, row)
                await aupdate_progress_artifact(self._artifact, done(row), description=said)


def done(row: Mapping[str, Any]) -> float:
    """Return the percentage of the budget that is used."""
    used, left = float(row["seconds"]), float(row["seconds_left"])
    return round(100.0 * used / max(used + left, 1e-9), 1)


def format_row(name: str, row: Mapping[str, Any]) -> str:
    """Return a row of progress for a person."""
    minutes, seconds = divmod(int(row["seconds_left"]), 60)
    survived = row.get("survived_s")
    lived = "no episode has ended" if survived is None else f"survives {survived:.2f} s"
    rate = f"{row['steps_per_s']:,.0f} steps/s"
    return f"{name}: {lived}, {int(row['steps']):,} steps, {rate}, {minutes}:{seconds:02d} left"
