"""Cells that play: the flow, its tasks, processes, store and tables are real, the learning is not.

A training burns or sleeps a number of seconds in a process of its own and leaves tables of one row.
"""

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

from prefect import flow

from flows import ablation, cells
from robojackson.files import tables
from robojackson.pipeline.table_schemas import EPISODE_RECORD, EVALUATION_RECORD
from storage.artifact import Artifact
from storage.store import Store
from tasks import evaluate_policy, train_policy
from tasks.evaluate_policy import ROLLOUT, SUMMARY, TABLE
from tasks.study_cell import Cell

NAMES = {"run_id": "played", "move": "played", "setup": "played", "seed": 0}
EPISODE = {**NAMES, "step": 1, "episode": 0, "episode_return": 1.0, "episode_length": 1}
VERDICT = {"phase": 0, "reset": 0, "survived_s": 1.0, "fell": False, "clip_fraction": 1.0}
ROLLOUTS = {**NAMES, **VERDICT, "policy": "trained", "success": 1.0, "strict_success": 0.0}
BURN = "import time\nwhile time.process_time() < {seconds}: pass"
SLEEP = "import time\ntime.sleep({seconds})"
SAID = {"trainer": "none", "seed": 0, "steps": 1, "updates": 0, "stopped": "", "episodes": 1}
MARK = "played-work"
"""By which its processes are found."""
NAP_S = 1.0


@contextmanager
def played(seconds: float, burn: bool, began: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Replace every training and evaluation of this process by a stand-in.

    Args:
        seconds: Length of a training, processor time if it burns; an evaluation takes none.
        began: Called whenever a training begins.
    """
    code = (BURN if burn else SLEEP).format(seconds=seconds)

    def command(*given: Any) -> list[str]:
        began()
        work = Path(given[1])
        (work / "policy.safetensors").write_bytes(given[4].encode())
        rows = tables.encode_rows(EPISODE_RECORD, [EPISODE])
        (work / "episodes.parquet").write_bytes(rows)
        answer = json.dumps({**SAID, "seconds": seconds})
        return [sys.executable, "-S", "-E", "-c", f"{code}\nprint({answer!r})", MARK]

    async def evaluated(command: list[str], name: str, work: Path, limit_s: float | None) -> bytes:
        (work / TABLE).write_bytes(tables.encode_rows(EVALUATION_RECORD, [ROLLOUTS]))
        (work / SUMMARY).write_text(json.dumps({"survived_s": 1.0, "skill": 0.0}))
        (work / ROLLOUT).write_bytes(name.encode())
        return b""

    with (
        patch.object(train_policy, "_command", command),
        patch.object(evaluate_policy, "run_process", evaluated),
    ):
        yield


@contextmanager
def motionless() -> Iterator[None]:
    """Let the motions of a study be words: its cells play and look at none."""

    def motion(name: str, move: Any, study: Any, trainings: Any) -> dict[str, Artifact]:
        store = Store.from_environment()
        names = ("reference", "scorecard", "still")
        made = {name: store.save("played", name, move.clip.encode()) for name in names}
        return made | {"reward_audits": store.save("played", "reward_audits", b"{}")}

    with (
        patch.object(ablation, "motion", motion),
        patch.object(ablation, "gate", lambda study, scorecards: None),
    ):
        yield


@flow(name="cell", flow_run_name="{cell.name}")
async def pooled(cell: Cell) -> dict[str, Artifact]:
    """Run a cell on a worker that sleeps in place of learning."""
    with played(NAP_S, burn=False):
        return await cells.cell.fn(cell)
