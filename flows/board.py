"""What a person sees of an ablation while it runs: one table that grows as its cells end."""

import json
import time
from collections.abc import Mapping
from typing import Any

from prefect.artifacts import acreate_table_artifact
from prefect.logging import get_run_logger

from configs.study import Study
from storage.artifact import Artifact
from storage.store import Store
from tasks.cell import Cell

SHOWN = ("survived_s", "strict_success", "skill", "limb_gain")
SMALL, SECONDS_BETWEEN = 40, 10.0
"""Rows up to which every change is shown, and what lies between two versions of a larger table."""
WAITING, RUNNING, DONE, FAILED = "waiting", "running", "done", "failed"
GIVEN = "with the workers"


class Board:
    """The state of every cell, shown on Prefect's pages under one key a study."""

    def __init__(self, study: Study, cells: list[Cell]) -> None:
        self.key = f"ablation-{study.name.lower().replace('_', '-').replace('.', '-')}"
        self._told = f"Study {study.name}: {len(cells)} cells of {study.steps:,} steps"
        self._shown = -SECONDS_BETWEEN
        self._begun = RUNNING if study.executor == "local" else GIVEN
        self._rows: dict[str, dict[str, Any]] = {
            c.name: {
                "cell": c.name,
                "move": c.move,
                "setup": c.setup,
                "seed": c.seed,
                "state": WAITING,
                **dict.fromkeys(SHOWN, ""),
                "reason": "",
            }
            for c in cells
        }

    def running(self, cell: Cell) -> None:
        """The cell has begun, or waits for a worker that takes it."""
        self._rows[cell.name]["state"] = self._begun

    async def done(self, cell: Cell, made: Mapping[str, Artifact]) -> None:
        """The cell has ended well; its figures go into the table."""
        summary = json.loads(Store.from_environment().read(made["evaluation"].key))
        figures = {name: _short(summary.get(name)) for name in SHOWN}
        self._rows[cell.name] |= {"state": DONE, **figures}
        await self.show(now=self._few())

    async def failed(self, cell: Cell, reason: str) -> None:
        """The cell has failed."""
        self._rows[cell.name] |= {"state": FAILED, "reason": reason}
        await self.show(now=self._few())

    def _few(self) -> bool:
        """Whether every change is shown: the table is small, or the last cell has ended."""
        ended = all(row["state"] in (DONE, FAILED) for row in self._rows.values())
        return ended or len(self._rows) <= SMALL

    async def show(self, now: bool = True) -> None:
        """A new version of the table; the old ones are its history.

        Args:
            now: Otherwise only if the last one is old: a table of a thousand rows for each of a
                thousand cells would be all that the server does.
        """
        if not now and time.monotonic() - self._shown < SECONDS_BETWEEN:
            return
        self._shown = time.monotonic()
        ended = sum(row["state"] in (DONE, FAILED) for row in self._rows.values())
        told = f"{self._told}; {ended} of {len(self._rows)} have ended"
        rows = list(self._rows.values())
        try:
            await acreate_table_artifact(key=self.key, table=rows, description=told)
        except Exception as cause:  # a server that is away is no reason to fail a cell
            get_run_logger().warning("the table on Prefect's page is not up to date: %s", cause)


def _short(value: Any) -> Any:
    return round(value, 3) if isinstance(value, float) else value
