"""The reference motion that each row of a training was made on, by the sha256 of its poses.

`references.json` beside the rows holds them, by move and seed. A row whose reference is no longer
the frozen one (`split.yaml`) is stale; one that is not recorded is older than the freeze, or of a
motion that was never frozen.
"""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from threading import Lock
from typing import Any

from benchmarks.learning.policies import MOVES, Folders, load
from benchmarks.learning.split import load_split
from robojackson.motion.reference_motion import poses_sha256

OLDER, NOT_RECORDED, FROZEN = "older", "not recorded", "frozen"
_WRITING = Lock()


def record_reference(row: Path, reference: Path, folders: Folders) -> None:
    """Record the poses that a row was trained and evaluated on."""
    with _WRITING:
        known = {**recorded(folders), _key(row): poses_sha256(load(reference))}
        part = _file(folders).with_suffix(".part")
        part.write_text(json.dumps(dict(sorted(known.items())), indent=1) + "\n")
        part.replace(_file(folders))


def recorded(folders: Folders) -> dict[str, str]:
    """Return the sha256 of the reference of each row, by move and seed."""
    found = _file(folders)
    return json.loads(found.read_text()) if found.is_file() else {}


def standing(
    name: str, rows: Iterable[Path], folders: Folders, frozen: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Return whether the rows of a move stand on its frozen reference, and the seeds that do not.

    Args:
        rows: Files of the rows, one a seed.
        frozen: sha256 of the frozen references by move; those of `split.yaml` when None.
    """
    frozen = load_split().references if frozen is None else frozen
    expected, known = frozen.get(MOVES[name].same_as or name), recorded(folders)
    by_seed = {_seed(row): known.get(_key(row)) for row in rows}
    unknown = [seed for seed, found in by_seed.items() if None in (found, expected)]
    older = [s for s, found in by_seed.items() if s not in unknown and found != expected]
    status = OLDER if older else NOT_RECORDED if unknown else FROZEN
    return {"reference": status, "stale_seeds": older}


def _file(folders: Folders) -> Path:
    return folders.rows / "references.json"


def _key(row: Path) -> str:
    """Return the move, budget and seed of a row; its horizons share the policy."""
    move, seed = row.stem.rsplit("-s", 1)
    return f"{move}-s{seed.split('-')[0]}"


def _seed(row: Path) -> int:
    return int(_key(row).rsplit("-s", 1)[1])
