"""The tables of a cell, put where questions find them, with where they come from beside them."""

import json
import os
import platform
import subprocess
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from storage import metrics
from storage.artifact import Artifact
from storage.store import Store
from tasks.cell import Cell

CHECKOUT = Path(__file__).parent.parent
COMMIT = "ROBOJACKSON_COMMIT"
TOLD = ("robojackson", "mujoco", "gymnasium", "torch", "jax", "sbx-rl", "sb3-contrib", "prefect")
"""Packages whose version is written down."""


def publish(cell: Cell, run_id: str, made: Mapping[str, Artifact]) -> dict[str, Artifact]:
    """Write the cell's rows and where these come from; the same call again writes nothing.

    Args:
        run_id: Of the training.
        made: What its stages left.
    """
    store = Store.from_environment()
    place = metrics.Place(cell.study, cell.move, cell.setup, cell.seed, run_id)
    written = metrics.write(store, place, made)
    if metrics.noted(store, place).get("artifacts") != _digests(made):
        metrics.note(store, place, provenance(cell, place, made))
    return written


def provenance(cell: Cell, place: metrics.Place, made: Mapping[str, Artifact]) -> dict[str, Any]:
    """Where the numbers of a cell come from: code, configuration, inputs, machine, time."""
    return {
        **asdict(place),
        "mode": cell.train.mode,
        "git_commit": _commit(),
        "config": asdict(cell.train),
        "evaluate": asdict(cell.evaluate),
        "robot": cell.robot,
        "artifacts": _digests(made),
        "reference_sha256": cell.reference.sha256,
        "versions": {name: _version(name) for name in TOLD},
        "machine": f"{platform.node()} {platform.machine()} {os.cpu_count()} cores",
        "python": platform.python_version(),
        "finished_at": datetime.now(UTC).isoformat(timespec="seconds"),
        "training": json.loads(Store.from_environment().read(made["training"].key)),
    }


def _digests(made: Mapping[str, Artifact]) -> dict[str, str]:
    return {name: artifact.sha256 for name, artifact in sorted(made.items())}


@cache
def _commit() -> str:
    """Of the checkout, `-dirty` where files differ from it; without git, as in a container, what
    ROBOJACKSON_COMMIT says.
    """
    command = ["git", "-C", str(CHECKOUT), "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return os.environ.get(COMMIT, "")
    return run.stdout.strip() if run.returncode == 0 else os.environ.get(COMMIT, "")


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
