"""Go on with the study `paper`: cells of more seeds, by the code and on the motions of the others.

    python -m benchmarks.learning.paper_study --seeds 4 [--slots 2] [--folder FOLDER]

A cell belongs to the 48 of `benchmarks/results/ablation` only where it learns on the same three
motions by the same code. The motions lie there (`references`), since motion capture rounds
otherwise on most processors; the code is checked out beside this one. The tables of all cells are
in the folder's store afterwards. Computes only what is missing there; Ctrl-C loses one cell.
"""

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

from benchmarks.learning.policies import ROOT

CODE = "a4d4f4f5"
"""Commit that the cells of the study were computed by."""
KEPT = ROOT / "benchmarks" / "results" / "ablation"
DRIVER = """
import sys
from pathlib import Path
import flows.ablation as study
from storage.store import Store

kept, usual = Path(sys.argv.pop(1)), study.motion

def motion(move, settings):
    content = kept / (Path(move.clip).stem + ".parquet")
    reference = Store.from_environment().keep("retarget", "reference.parquet", content)
    return usual(move, settings) | {"reference": reference}

study.motion = motion
from flows.start import main
main()
"""
"""Runs the study's command in the checkout of that code, on the motions of a folder."""


def main() -> None:
    """Compute the cells of the seeds that are missing."""
    given = _arguments()
    folder = given.folder.absolute()
    store = folder / "store"
    code = checkout(folder / "code")
    if not (store / "metrics").exists():
        shutil.copytree(KEPT / "metrics", store / "metrics")
    environment = {
        **os.environ,
        "OMP_NUM_THREADS": "1",
        "PYTHONPATH": str(code),
        "ROBOJACKSON_STORE": str(store),
        "PREFECT_HOME": str(folder / "prefect"),
    }
    words = [word for seed in given.seeds for word in ("--seed", str(seed))]
    line = [sys.executable, "-c", DRIVER, str(KEPT / "references"), "ablation", "paper"]
    line += [*words, "--slots", str(given.slots)]
    raise SystemExit(subprocess.run(line, check=False, cwd=code, env=environment).returncode)


def checkout(folder: Path) -> Path:
    """Return a folder with the study's code, checked out unless it is there."""
    if not folder.exists():
        git = ["git", "-C", str(ROOT), "worktree", "add", "--detach", str(folder), CODE]
        subprocess.run(git, check=True)
    return folder


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", nargs="+", type=int, required=True)
    parser.add_argument("--slots", type=int, default=1, help="cells at a time, each on a core")
    parser.add_argument("--folder", type=Path, default=ROOT / "store" / "paper-study")
    return parser.parse_args()


if __name__ == "__main__":
    main()
