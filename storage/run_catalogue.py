"""The catalogue of runs: one small JSON file a run, so that two runs never write the same file."""

import json
from dataclasses import asdict
from datetime import datetime
from typing import Annotated, Any

from pydantic import Field, TypeAdapter, ValidationError

from robojackson.config import config_dataclass
from robojackson.errors import BadTable
from robojackson.files.json_types import to_json_types
from storage.artifact import Artifact
from storage.store import Store

FOLDER = "runs"


@config_dataclass
class Run:
    """One pass through the pipeline.

    Attributes:
        run_id: Unique name, of letters, digits and `_.-`.
        move: Name of the dance, as `run_name` leaves it.
        robot: Name of the robot description.
        setup: Name of the training setup.
        seed: Seed of the training.
        finished_at: When, with time zone.
        artifacts: What it made, by name.
        summary: Figures of the run.
    """

    run_id: Annotated[str, Field(pattern=r"^[\w.-]+$")]
    move: str
    robot: str
    setup: str
    seed: int
    finished_at: datetime
    artifacts: dict[str, Artifact] = Field(default_factory=dict)
    summary: dict[str, Any] = Field(default_factory=dict)


def record(store: Store, run: Run) -> Artifact:
    """Record a run, replacing its earlier record."""
    facts = to_json_types(asdict(run))
    text = json.dumps(facts, indent=1, sort_keys=True, allow_nan=False)
    return store.put(f"{FOLDER}/{run.run_id}.json", text.encode())


def list_runs(store: Store) -> list[Run]:
    """Return all runs, the latest last.

    Raises:
        BadTable: a file of the catalogue is not a run.
    """
    found = [_read(store, key) for key in store.list(FOLDER) if key.endswith(".json")]
    return sorted(found, key=lambda run: run.finished_at)


def _read(store: Store, key: str) -> Run:
    try:
        return TypeAdapter(Run).validate_json(store.read(key))
    except ValidationError as cause:
        first = cause.errors()[0]
        field = ".".join(str(part) for part in first["loc"])
        raise BadTable(f"{store.address(key)}: {field}: {first['msg']}") from cause
