"""Rows of the league from kept results: our trainings' Parquets and the table of trackers.

Every motion has a row of each dancer; one that cannot be had gives its reason in `why`.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.learning import tracker_rows
from benchmarks.learning.policies import MOVES as POLICIES
from benchmarks.learning.policies import Folders
from benchmarks.learning.split import load_split
from benchmarks.learning.tracker_rows import FEET

MOVES = (
    *("g1_hip_shake", "g1_walk", "g1_dance_b", "g1_dance_a", "g1_authors_apt1", "g1_authors_walk"),
    *("g1_cmu_05_02", "g1_cmu_05_09", "g1_cmu_05_18"),
    *(f"g1_person_cam{camera}" for camera in (1, 2, 3, 4)),
)
SEEDS = (100, 101, 102, 103, 104)
FIGURES = ("success", "strict_success", "skill", "mpjpe_l_m", "mpjpe_g_alive_m", "velocity_score",
           "acceleration_ratio")  # fmt: skip
COLUMNS = (*FIGURES, "feet_excess_m_s", "starts", "seeds", "cpu_s", "data", "in_training", "note",
           "why")  # fmt: skip
INSTANT, REPLAY, TWIST2 = "ours, instant (regulator)", "reference replayed", "twist2"
INSTANT_ONBOARD = "ours, instant (regulator_onboard)"
DANCER = "ours, one network (dancer)"
TRAINED, ORDINARY = "ours, regulator polished by training", "ours, ordinary training on regulator"
SCRATCH, ONBOARD = "ours, from scratch", "ours, from scratch (onboard)"
TRAINED_ONBOARD = "ours, regulator_onboard polished by training"
WITHOUT_ESTIMATE = ("g1_hip_shake", "g1_walk", "g1_authors_apt1")
"""Motions whose onboard rows are from scratch, from before a training had an estimated root; today
that is `--set track.control.feedback=0`."""
POLISHED = "ours, twist2 polished"
NOT_POLISHED = ("g1_walk",)
"""Motions whose rows are ordinary trainings on the feedback: that of seed 100 along the reference,
the others along a sampled path (`docs/learning_g1.md`, "Linear feedback")."""
NOTES = {
    "g1_dance_b": "the feedback alone with each seed, which was kept at the training's end",
    "g1_walk": "seed 100 on the feedback along the reference, the others on a sampled path",
}
"""What differs in trained rows from other rows, or among their seeds."""
OF_NOTEBOOK = "its row was replaced by the one with feedback (docs/learning_g1.md#linear-feedback)"
WITHOUT_FEEDBACK = {
    "g1_hip_shake": f"100 %, skill .63, 8 mm; {OF_NOTEBOOK}",
    "g1_walk": f"94.5 %, skill .64, 41 mm; {OF_NOTEBOOK}",
    "g1_dance_b": f"1.4 % on the reference of 23 November; {OF_NOTEBOOK}",
}
NOT_TRAINED = "no training without feedback on this motion"
NOT_POLISHED_TWIST2 = "tried on cmu_05_11, worse than the tracker (docs/learning_g1.md)"
UNTRAINED = "policies are trained on none of the cameras"
UNMEASURED = "python -m benchmarks.learning.tracker_rows"
OF_28_NOVEMBER = "figures of 28 November: docs/learning_g1.md, One policy for many motions"
"""Of the dancer on files that are not ours, whose references a processor without AVX-512 does not
make to the last bit."""
OF_MOTION = {"data": "the motion", "in_training": "seen"}
OF_OTHERS = {"data": "AMASS and others, on GPUs", "in_training": "unseen"}
"""Our references were made here, from videos that no training of theirs has seen; CMU's motions are
a part of AMASS."""
OF_DANCER = {"data": "125 motions, on a GPU", "in_training": "unseen"}
ALIKE = {f"g1_{name}" for name in load_split().exceptions["dancer"]["nothing_claimed_on"]}
"""Motions that the dancer has seen parts of, or ones like them."""
Row = dict[str, Any]


def kept_rows(folders: Folders) -> Iterator[Row]:
    """Yield every row of our references: one a motion and a dancer."""
    for move in MOVES:
        yield from of_trainings(folders, move)
        yield from of_trackers(folders, move)
        yield row(SCRATCH, move, why=WITHOUT_FEEDBACK.get(move, NOT_TRAINED))
        yield row(POLISHED, move, why=NOT_POLISHED_TWIST2)


def row(who: str, motion: str, figures: Mapping[str, Any] | None = None, **known: Any) -> Row:
    """Return one line of the league."""
    empty = {"who": who, "motion": motion, **dict.fromkeys(COLUMNS), "note": "", "why": ""}
    return {**empty, **(figures or {}), **known}


def of_trainings(folders: Folders, move: str) -> Iterator[Row]:
    """Yield the means over seeds of what our trainings of a move have left."""
    who = ORDINARY if move in NOT_POLISHED else TRAINED
    yield _trained(folders, move, move, who, note=NOTES.get(move, ""))
    onboard = ONBOARD if move in WITHOUT_ESTIMATE else TRAINED_ONBOARD
    yield _trained(folders, f"{move}_onboard", move, onboard)


def _trained(folders: Folders, name: str, move: str, who: str, **known: Any) -> Row:
    policy = POLICIES.get(name)
    if policy is None or not policy.trained:
        return row(who, move, why=UNTRAINED)
    found = {seed: folders.row(name, seed, 10.0) for seed in SEEDS}
    seeds = [seed for seed, path in found.items() if path.is_file()]
    if not seeds:
        return row(who, move, why=f"not trained: learning_suite policies --moves {name}")
    tables = [pd.read_parquet(found[seed]) for seed in seeds]
    own = [table[table["policy"] == "trained"] for table in tables]
    figures = {name: float(np.mean([t[name].mean() for t in own])) for name in FIGURES}
    facts: Row = {
        "feet_excess_m_s": float(np.mean([t[list(FEET)].to_numpy().mean() for t in own])),
        "starts": len(own[0]),
        "seeds": len(seeds),
        "cpu_s": 60.0 * policy.cpu_minutes,
    }
    return row(who, move, figures, **facts | OF_MOTION | known)


def of_trackers(folders: Folders, move: str) -> Iterator[Row]:
    """Yield the rows of trackers and of the bare reference at friction 1."""
    table = tracker_rows.held_in(folders)
    others = OF_OTHERS | ({"in_training": "likely"} if POLICIES[move].cmu else {})
    dancers = OF_DANCER | ({"in_training": "likely"} if move in ALIKE else {})
    for who, name, known in (
        (INSTANT, "regulator", OF_MOTION),
        (INSTANT_ONBOARD, "regulator_onboard", OF_MOTION),
        (DANCER, "dancer", dancers),
        (TWIST2, "twist2", others),
        (REPLAY, tracker_rows.REPLAY, OF_MOTION),
    ):
        found = [r for r in table if (r["tracker"], r["move"], r["friction"]) == (name, move, 1.0)]
        if not found:
            in_notebook = who == DANCER and POLICIES[move].is_foreign
            how = f"{UNMEASURED} --trackers {name} --moves {move}"
            yield row(who, move, why=OF_28_NOVEMBER if in_notebook else how)
            continue
        last, note = found[-1], ""
        taken = {figure: last.get(figure) for figure in (*FIGURES, "feet_excess_m_s", "cpu_s")}
        if "velocity_score" not in last:
            note = "velocity and feet not measured: minutes of search again"
        yield row(who, move, taken, starts=last["starts"], note=note, **known)
