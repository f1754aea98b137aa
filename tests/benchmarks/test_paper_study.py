"""The motions that the study `paper` goes on with are those of its first cells."""

import hashlib
import json

from benchmarks.learning.paper_study import CODE, KEPT

RUNS = [json.loads(path.read_text()) for path in sorted((KEPT / "metrics" / "runs").iterdir())]


def test_every_cell_learnt_on_a_motion_that_is_kept() -> None:
    files = (KEPT / "references").iterdir()
    kept = {path.stem: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}
    assert len(RUNS) >= 48
    assert {(run["move"], run["reference_sha256"]) for run in RUNS} == set(kept.items())


def test_new_cells_run_the_code_of_the_others() -> None:
    assert {run["git_commit"][: len(CODE)] for run in RUNS} == {CODE}
