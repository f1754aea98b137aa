"""The tables of a cell, put where questions find them, with where they come from beside them; and
those of a pass, under the names of its run."""

import json
import os
import platform
import subprocess
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from robojackson.errors import StoreError
from robojackson.files import tables
from robojackson.files.json_types import to_json_types
from robojackson.pipeline.app_folder import app_folder, is_checkout
from robojackson.pipeline.robot_descriptions import describe_robot
from storage import study_tables
from storage.artifact import Artifact
from storage.store import Store
from storage.study_tables import Place
from tasks.study_cell import Cell
from tasks.train_policy import RunLabels

Result = dict[str, Artifact]
RESULT = "result"
"""Under which the note of a cell keeps its artifacts, keys and digests."""
COMMIT = "ROBOJACKSON_COMMIT"
PACKAGES = (
    "robojackson",
    "mujoco",
    "gymnasium",
    "torch",
    "jax",
    "sbx-rl",
    "sb3-contrib",
    "prefect",
)
"""Packages whose version is written down."""


def publish(cell: Cell, run_id: str, made: Mapping[str, Artifact]) -> Result:
    """Write the cell's rows and where these come from; the same call again writes nothing.

    Args:
        run_id: Run id of the training.
        made: Artifacts of its stages.
    Returns:
        What the stages left, with the tables under their keys among the metrics.
    """
    store = Store.from_environment()
    place = _place(cell, run_id)
    written = {**made, **study_tables.write(store, place, made)}
    noted = study_tables.read_note(store, place)
    known = {"artifacts": _digests(made), RESULT: to_json_types(written)}
    if {name: noted.get(name) for name in known} != known:
        study_tables.note(store, place, {**provenance(cell, place, made), **known})
    return written


def published(cell: Cell, run_id: str) -> Result:
    """Return what `publish` returned, on any machine.

    Raises:
        StoreError: this store has nothing of that run.
    """
    store = Store.from_environment()
    try:
        found = study_tables.read_note(store, _place(cell, run_id))[RESULT]
        return {name: Artifact(**artifact) for name, artifact in found.items()}
    except (KeyError, TypeError, ValueError, AttributeError) as cause:
        raise StoreError(
            f"{cell.name}: its worker ended well, but {store.root} has no result of run {run_id}: "
            "the worker uses another store or another version of the code; give it the same "
            "ROBOJACKSON_STORE (an absolute path, or an address) and the same checkout"
        ) from cause


def place_of_pass(
    made: Mapping[str, Artifact], labels: RunLabels, tracker: str | None, seed: int
) -> Place:
    """Return the names of the run of a pass in all of its tables.

    Args:
        made: What the stages made, by name.
        tracker: The tracker that dances; None where a policy was trained.
        seed: Seed of the training.
    """
    setup, seed = (tracker, 0) if tracker else (labels.setup, seed)
    danced = made["evaluation" if tracker else "policy"]
    run_id = f"{labels.move}-{setup}-s{seed}-{danced.sha256[:8]}"
    return Place(study_tables.DANCES, labels.move, setup, seed, run_id)


def content_at(place: Place, store: Store, name: str, artifact: Artifact) -> bytes:
    """Return the content of an artifact, a table of a run under the names of this one: a recorded
    stage may have made it for another dance of the same video."""
    content, schema = store.read(artifact.key), study_tables.CELL.get(name)
    if schema is None:
        return content
    rows = tables.decode_rows(schema, content, store.address(artifact.key))
    return tables.encode_rows(schema, study_tables.relabelled(place, rows))


def provenance(cell: Cell, place: Place, made: Mapping[str, Artifact]) -> dict[str, Any]:
    """Return where the numbers of a cell come from: code, configuration, inputs, machine, time."""
    return {
        **asdict(place),
        "mode": cell.train.mode,
        "git_commit": _commit(),
        "config": asdict(cell.train),
        "evaluate": asdict(cell.evaluate),
        "robot": describe_robot(cell.robot).name,
        "reference_sha256": cell.reference.sha256,
        "versions": {name: _version(name) for name in PACKAGES},
        "machine": f"{platform.node()} {platform.machine()} {os.cpu_count()} cores",
        "python": platform.python_version(),
        "finished_at": datetime.now(UTC).isoformat(timespec="seconds"),
        "training": json.loads(Store.from_environment().read(made["training"].key)),
    }


def _place(cell: Cell, run_id: str) -> Place:
    return Place(cell.study, cell.move, cell.setup, cell.seed, run_id)


def _digests(made: Mapping[str, Artifact]) -> dict[str, str]:
    return {name: artifact.sha256 for name, artifact in sorted(made.items())}


@cache
def _commit() -> str:
    """Return the commit of the checkout, `-dirty` where files differ from it; without git, as in a
    container, the value of ROBOJACKSON_COMMIT.
    """
    if (
        not is_checkout()
    ):  # an environment inside another repository has that one's commit, which is not ours
        return os.environ.get(COMMIT, "")
    command = ["git", "-C", str(app_folder()), "describe", "--always", "--dirty", "--abbrev=40"]
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
