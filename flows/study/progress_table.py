"""Progress table of an ablation, which grows as its cells end."""

import asyncio
import json
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from typing import Any

from prefect.artifacts import acreate_table_artifact
from prefect.logging import get_run_logger

from configs.study_config import Study
from robojackson.pipeline.run_names import slug_of
from storage.artifact import Artifact
from storage.store import Store
from tasks.study_cell import Cell

COLUMNS = ("survived_s", "strict_success", "skill", "limb_gain")
SECONDS_A_ROW, SECONDS_BETWEEN = 0.05, (1.0, 60.0)
"""Time between two versions of the table: longer for a longer one, within bounds."""
WAITING, RUNNING, DONE, FAILED = "waiting", "running", "done", "failed"
ON_WORKERS = "with the workers"


class ProgressTable:
    """The state of every cell, shown on Prefect's pages under one key a study."""

    def __init__(self, study: Study, cells: list[Cell]) -> None:
        self.key = f"ablation-{slug_of(study.name)}"
        self._caption = f"Study {study.name}: {len(cells)} cells of {study.steps_label} steps"
        self._changed = asyncio.Event()
        self._begun = RUNNING if study.executor == "local" else ON_WORKERS
        self._rows: dict[str, dict[str, Any]] = {
            c.name: {
                "cell": c.name,
                "move": c.move,
                "setup": c.setup,
                "seed": c.seed,
                "state": WAITING,
                **dict.fromkeys(COLUMNS, ""),
                "reason": "",
            }
            for c in cells
        }

    def running(self, cell: Cell) -> None:
        """Record that the cell has begun, or waits for a worker."""
        self._change(cell, state=self._begun)

    def done(self, cell: Cell, made: Mapping[str, Artifact]) -> None:
        """Record that the cell has succeeded, with its figures."""
        summary = json.loads(Store.from_environment().read(made["evaluation"].key))
        figures = {name: _short(summary.get(name)) for name in COLUMNS}
        self._change(cell, state=DONE, **figures)

    def failed(self, cell: Cell, reason: str) -> None:
        """Record that the cell has failed."""
        self._change(cell, state=FAILED, reason=reason)

    @asynccontextmanager
    async def shown(self) -> AsyncIterator[None]:
        """Show the table for the time of a block, and at its end as it is then.

        Many changes are one new version, the old ones are its history: a table of a thousand rows
        for each of a thousand cells would be all that the server does.
        """
        showing = asyncio.create_task(self._keep_showing())
        try:
            yield
        finally:
            showing.cancel()
            await asyncio.gather(showing, return_exceptions=True)
        await self._show()

    async def _keep_showing(self) -> None:
        least, most = SECONDS_BETWEEN
        while True:
            await self._show()
            await asyncio.sleep(min(max(SECONDS_A_ROW * len(self._rows), least), most))
            await self._changed.wait()

    async def _show(self) -> None:
        self._changed.clear()
        ended = sum(row["state"] in (DONE, FAILED) for row in self._rows.values())
        caption = f"{self._caption}; {ended} of {len(self._rows)} have ended"
        rows = list(self._rows.values())
        try:
            await acreate_table_artifact(key=self.key, table=rows, description=caption)
        except Exception as cause:  # a server that is away is no reason to fail a cell
            get_run_logger().warning("the table on Prefect's page is not up to date: %s", cause)

    def _change(self, cell: Cell, **columns: Any) -> None:
        self._rows[cell.name] |= columns
        self._changed.set()


def _short(value: Any) -> Any:
    return round(value, 3) if isinstance(value, float) else value
