"""The league: who dances the G1's references how well, by one judge on one robot.

    python -m benchmarks.learning.league [--holosoma FOLDER] [--rows N]

`make bench-league`. Resumable: a row that is there stays. Rows of our trainings and of trackers are
read from their own tables (`benchmarks.learning.policies`, `tracker_rows`); holosoma's policies are
run here, on ten seconds of their own motion, where FOLDER holds the unpacked wheel
(`pip download --no-deps holosoma-inference==0.1.3`). A row that cannot be had says why.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.learning.error_line import errors_in_one_line
from benchmarks.learning.policies import MOVES as POLICIES
from benchmarks.learning.policies import Folders
from benchmarks.learning.tracker_rows import present
from robojackson.api.robots import load_robot
from robojackson.errors import MissingDependency
from robojackson.files.json_types import to_json_types
from robojackson.rl.config.evaluate_config import EvaluateConfig
from robojackson.rl.evaluation.policy_evaluation import evaluate_policy
from robojackson.rl.trackers.tracker import Tracker

MOVES = (
    *("g1_hip_shake", "g1_walk", "g1_dance_b", "g1_dance_a", "g1_authors_apt1", "g1_authors_walk"),
    *("g1_cmu_05_02", "g1_cmu_05_09", "g1_cmu_05_18"),
)
OWN_MOTION = "holosoma_dance"
FIRST, STEPS = {"fastsac": 2100, "ppo": 2000}, 500
"""Of the motion inside their files: the same ten seconds."""
MODELS = "holosoma_inference/models/wbt"
EVALUATION = EvaluateConfig(resets=1)
FIGURES = ("success", "strict_success", "skill", "mpjpe_l_m", "mpjpe_g_alive_m", "velocity_score",
           "acceleration_ratio")  # fmt: skip
FEET = ("excess_speed_left_foot", "excess_speed_right_foot")
COLUMNS = (*FIGURES, "feet_excess_m_s", "cpu_s", "data", "in_training", "why")
INSTANT, TRAINED = "ours, instant (regulator)", "ours, regulator polished by training (seed 100)"
SCRATCH, POLISHED, REPLAY = "ours, from scratch", "ours, twist2 polished", "reference replayed"
MISSING = {
    SCRATCH: "no rows kept of trainings without feedback; figures of them: docs/learning.md",
    POLISHED: "tried on cmu_05_11, worse than the tracker (docs/learning_g1.md)",
    REPLAY: "kept rows replay it with feedback, which is the regulator",
}
Row = dict[str, Any]


def main() -> None:
    """Add the rows that are missing, and write both tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--holosoma", type=Path, help="folder of the unpacked wheel")
    parser.add_argument("--folder", type=Path, help="for everything, instead of the usual places")
    given = parser.parse_args()
    folders = Folders.at(given.folder)
    path = folders.results / "league.json"
    held = json.loads(path.read_text())["rows"] if path.is_file() else []
    rows = {(row["who"], row["motion"]): row for row in held if not row["why"]}
    for row in every_row(folders, given.holosoma, lambda key: key in rows):
        key = (row["who"], row["motion"])
        if key not in rows or rows[key]["why"] or not row["why"]:
            rows[key] = row
        save(list(rows.values()), path)
    print(path.with_suffix(".md").read_text())


def every_row(
    folders: Folders, wheel: Path | None, known: Callable[[tuple[str, str]], bool]
) -> Iterator[Row]:
    """Yield all rows; those that are known and dear to compute are left out."""
    for move in MOVES:
        yield from trained(folders, move)
        yield from tracked(folders, move)
        for who, why in MISSING.items():
            yield row(who, move, why=why)
    for kind in FIRST:
        who = f"holosoma {kind}"
        if not known((who, OWN_MOTION)):
            yield from on_their_own(kind, who, wheel)
    for who in ("twist2", REPLAY):
        if not known((who, OWN_MOTION)):
            yield from others_on_theirs(who, wheel)
    yield row(INSTANT, OWN_MOTION, why="gains not computed for this motion")


def row(who: str, motion: str, figures: Row | None = None, **known: Any) -> Row:
    """Return one line of the league."""
    found = {"who": who, "motion": motion, **dict.fromkeys(COLUMNS), "why": ""}
    return {**found, **(figures or {}), **known}


def trained(folders: Folders, move: str) -> Iterator[Row]:
    """Yield what our training of a move has left."""
    path = folders.row(move, 100, 10.0)
    if not path.is_file():
        yield row(TRAINED, move, why="no row of seed 100: make bench-learning")
        return
    table = pd.read_parquet(path)
    rows = table[table["policy"] == "trained"]
    figures = {name: float(rows[name].mean()) for name in FIGURES}
    feet = float(rows[list(FEET)].to_numpy().mean())
    spent = 60.0 * POLICIES[move].cpu_minutes
    known = {"data": "the clip", "in_training": "seen"}
    yield row(TRAINED, move, figures, feet_excess_m_s=feet, cpu_s=spent, **known)


NOTHING = {"data": "none", "in_training": "unseen"}
TWIST2 = {"data": "AMASS and others, on GPUs", "in_training": "unseen"}
"""Our references were made here, from videos that no training of theirs has seen; CMU's motions are
a part of AMASS (`of_amass`)."""


def tracked(folders: Folders, move: str) -> Iterator[Row]:
    """Yield the rows of trackers at friction 1."""
    path = folders.results / "trackers.json"
    table = json.loads(path.read_text())["rows"] if path.is_file() else []
    for who, name, known in ((INSTANT, "regulator", NOTHING), ("twist2", "twist2", TWIST2)):
        found = [r for r in table if (r["tracker"], r["move"], r["friction"]) == (name, move, 1.0)]
        if found:
            figures = {figure: found[-1].get(figure) for figure in FIGURES}
            seen = {"in_training": "likely"} if name == "twist2" and of_amass(move) else {}
            yield row(who, move, figures, cpu_s=found[-1]["cpu_s"], **known | seen)
        else:
            yield row(who, move, why="python -m benchmarks.learning.tracker_rows")


def of_amass(move: str) -> bool:
    """Return whether a motion is probably among those of AMASS."""
    return POLICIES[move].cmu


def on_their_own(kind: str, who: str, wheel: Path | None) -> Iterator[Row]:
    """Yield one of holosoma's policies on its own motion."""
    policy = peer(kind, wheel)
    if policy is None:
        yield row(who, OWN_MOTION, why="holosoma-inference is not here: --holosoma FOLDER")
        return
    known = {"data": "its motion, on a GPU", "in_training": "seen"}
    yield row(who, OWN_MOTION, judged(policy, policy, kind)[0], **known)


def others_on_theirs(who: str, wheel: Path | None) -> Iterator[Row]:
    """Yield TWIST2, or the replay, on holosoma's motion."""
    policy = peer("ppo", wheel)
    try:
        tracker = policy if who == REPLAY else present(who)
    except MissingDependency:
        tracker = None
    if policy is None or tracker is None:
        yield row(who, OWN_MOTION, why="holosoma-inference or the tracker is not here")
        return
    mine, replayed = judged(tracker, policy, "ppo")
    known = NOTHING if who == REPLAY else {**TWIST2, "in_training": "likely"}
    yield row(who, OWN_MOTION, replayed if who == REPLAY else mine, **known)


def peer(kind: str, wheel: Path | None) -> Any:
    """Return holosoma's policy; None where its file is not here."""
    path = None if wheel is None else wheel / MODELS / f"{kind}_g1_29dof_dancing.onnx"
    if path is None or not path.is_file():
        return None
    from benchmarks.learning.holosoma_peer import HolosomaPolicy

    return HolosomaPolicy(kind, path)


def judged(tracker: Tracker, owner: Any, kind: str) -> tuple[Row, Row]:
    """Return the figures of a tracker on holosoma's motion, and of the replay with its gains."""
    robot = load_robot("g1")
    motion = owner.reference(robot, FIRST[kind], STEPS)
    began = time.process_time()
    found = evaluate_policy(tracker, motion, robot, EVALUATION)
    spent = time.process_time() - began
    replay = found.summary["baselines"]["zero_residual"]  # type: ignore[index]
    return _row(found.summary, spent), _row(replay, spent)


def _row(figures: Mapping[str, Any], spent: float) -> Row:
    """Return the figures of the league, and the processor time that they took."""
    feet = sum(float(figures[name]) for name in FEET) / 2
    return {**{name: figures[name] for name in FIGURES}, "cpu_s": spent, "feet_excess_m_s": feet}


def save(rows: list[Row], path: Path) -> None:
    """Write league.json and league.md."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(to_json_types({"rows": rows}), indent=1) + "\n")
    lines = [f"| {' | '.join(('motion', 'who', *COLUMNS))} |", "|---" * (len(COLUMNS) + 2) + "|"]
    for one in sorted(rows, key=lambda r: (r["motion"], r["who"])):
        cells = [one["motion"], one["who"], *(shown(one[name]) for name in COLUMNS)]
        lines.append(f"| {' | '.join(cells)} |")
    path.with_suffix(".md").write_text("\n".join(lines) + "\n")


def shown(value: Any) -> str:
    """Return a cell."""
    if value is None or value != value:
        return "-"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    with errors_in_one_line():
        main()
