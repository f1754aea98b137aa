"""The league: who dances the G1's references how well, by one judge on one robot.

    python -m benchmarks.learning.league [--holosoma FOLDER] [--folder F]

`make bench-league`. Rows of our trainings and of trackers are read from their own tables
(`league_rows`); holosoma's policies are run here, on ten seconds of their own motion, where FOLDER
holds the unpacked wheel (`pip download --no-deps holosoma-inference==0.1.3`); a row of theirs that
is there stays. A row that cannot be had gives its reason.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.learning.error_line import errors_in_one_line
from benchmarks.learning.league_rows import (
    COLUMNS,
    DANCER,
    FIGURES,
    INSTANT,
    INSTANT_ONBOARD,
    OF_DANCER,
    OF_MOTION,
    OF_OTHERS,
    ONBOARD,
    POLISHED,
    REPLAY,
    SCRATCH,
    TRAINED,
    TRAINED_ONBOARD,
    TWIST2,
    Row,
    kept_rows,
    row,
)
from benchmarks.learning.policies import Folders
from benchmarks.learning.tracker_rows import FEET, present
from robojackson.api.robots import load_robot
from robojackson.errors import MissingDependency
from robojackson.files.json_types import to_json_types
from robojackson.rl.config.evaluate_config import EvaluateConfig
from robojackson.rl.evaluation.policy_evaluation import evaluate_policy
from robojackson.rl.trackers.tracker import Tracker

OWN_MOTION = "holosoma_dance"
FIRST, STEPS = {"fastsac": 2100, "ppo": 2000}, 500
"""Of the motion inside their files: the same ten seconds."""
MODELS = "holosoma_inference/models/wbt"
EVALUATION = EvaluateConfig(resets=1)
NOT_OURS = "we trained nothing on holosoma's motion, which comes with its wheel alone"
NOT_ITS_OWN = {
    TWIST2: ("twist2", {**OF_OTHERS, "in_training": "likely"}),
    DANCER: ("dancer", OF_DANCER),
    REPLAY: (REPLAY, OF_MOTION),
}
"""Name of a tracker by its row on holosoma's motion, and the facts of that row."""
MISSING = {
    **dict.fromkeys((INSTANT, INSTANT_ONBOARD), "gains not computed for this motion"),
    TRAINED: NOT_OURS,
    SCRATCH: NOT_OURS,
    ONBOARD: NOT_OURS,
    TRAINED_ONBOARD: NOT_OURS,
    POLISHED: NOT_OURS,
}
"""Why rows of holosoma's motion cannot be had."""
TEXT = """# The league

`make bench-league`; [what it is](../../docs/trackers.md#the-league). Friction 1, tempo of the
reference; figures are means over all starts, those of trainings over all seeds, too.

- **starts**: trackers 24 phases and the stand (25); policies of a training each phase three times,
  with three noises (73).
- **cpu_s** of a training is its nominal budget, without the search for a sampled path, which is
  minutes (`regulator`'s row); of a tracker it is the whole evaluation, gains, search and baselines
  included.
- **`regulator`** is no pretrained network: its gains and its path are computed for the evaluated
  motion itself, with the robot's model, for up to minutes, and it sees the full state, also the
  place and velocity that no real robot measures. So its motion is `seen`.
- **reference replayed**: its angles as targets, led by its torques, with the robot's own gains and
  without feedback (on holosoma's motion: with the gains of its PPO policy).
- **`regulator_onboard`** is the same feedback, whose place and velocity of the root are estimated
  from joints, attitude, gyroscope and accelerometer.
- **`dancer`** is our one network for any motion, from a robot's own measurements
  (`docs/learning_g1.md`, "One policy for many motions").
"""


def main() -> None:
    """Compose the rows of our references, add holosoma's that are missing, and write both files."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--holosoma", type=Path, help="folder of the unpacked wheel")
    parser.add_argument("--folder", type=Path, help="for everything, instead of the usual places")
    given = parser.parse_args()
    folders = Folders.at(given.folder)
    path = folders.results / "league.json"
    save([*kept_rows(folders), *on_holosomas(held_in(path), given.holosoma)], path)
    print(path.with_suffix(".md").read_text())


def held_in(path: Path) -> dict[str, Row]:
    """Return the measured rows of holosoma's motion by dancer."""
    rows = json.loads(path.read_text())["rows"] if path.is_file() else []
    return {one["who"]: one for one in rows if one["motion"] == OWN_MOTION and not one["why"]}


def on_holosomas(held: Mapping[str, Row], wheel: Path | None) -> Iterator[Row]:
    """Yield every row of holosoma's motion; what is held is not measured again."""
    measurements: dict[str, Callable[[], Row]] = {
        **{f"holosoma {kind}": partial(on_its_own, kind, wheel) for kind in FIRST},
        **{who: partial(other_on_theirs, who, wheel) for who in NOT_ITS_OWN},
    }
    for who, measure in measurements.items():
        yield held[who] if who in held else measure()
    for who, why in MISSING.items():
        yield row(who, OWN_MOTION, why=why)


def on_its_own(kind: str, wheel: Path | None) -> Row:
    """Return the row of one of holosoma's policies on its own motion."""
    who, policy = f"holosoma {kind}", peer(kind, wheel)
    if policy is None:
        return row(who, OWN_MOTION, why="holosoma-inference is not here: --holosoma FOLDER")
    known = {"data": "its motion, on a GPU", "in_training": "seen"}
    return row(who, OWN_MOTION, evaluated(policy, policy, kind)[0], **known)


def other_on_theirs(who: str, wheel: Path | None) -> Row:
    """Return the row of a network, or of the replay, on holosoma's motion."""
    policy, (name, known) = peer("ppo", wheel), NOT_ITS_OWN[who]
    try:
        tracker = policy if who == REPLAY else present(name)
    except MissingDependency:
        tracker = None
    if policy is None or tracker is None:
        return row(who, OWN_MOTION, why="holosoma-inference or the tracker is not here")
    mine, replayed = evaluated(tracker, policy, "ppo")
    return row(who, OWN_MOTION, replayed if who == REPLAY else mine, **known)


def peer(kind: str, wheel: Path | None) -> Any:
    """Return holosoma's policy; None where its file is not here."""
    path = None if wheel is None else wheel / MODELS / f"{kind}_g1_29dof_dancing.onnx"
    if path is None or not path.is_file():
        return None
    from benchmarks.learning.holosoma_peer import HolosomaPolicy

    return HolosomaPolicy(kind, path)


def evaluated(tracker: Tracker, owner: Any, kind: str) -> tuple[Row, Row]:
    """Return the figures of a tracker on holosoma's motion, and of the replay with its gains."""
    robot = load_robot("g1")
    motion = owner.reference(robot, FIRST[kind], STEPS)
    began = time.process_time()
    found = evaluate_policy(tracker, motion, robot, EVALUATION)
    spent = time.process_time() - began
    replay = found.summary["baselines"]["zero_residual"]  # type: ignore[index]
    return _figures(found.summary, spent), _figures(replay, spent)


def _figures(summary: Mapping[str, Any], spent: float) -> Row:
    """Return the figures of the league, and the processor time that they took."""
    feet = sum(float(summary[name]) for name in FEET) / 2
    facts = {"cpu_s": spent, "feet_excess_m_s": feet, "starts": int(summary["rollouts"])}
    return {**{name: summary[name] for name in FIGURES}, **facts}


def save(rows: Sequence[Row], path: Path) -> None:
    """Write league.json and league.md."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(to_json_types({"rows": rows}), indent=1) + "\n")
    path.with_suffix(".md").write_text(f"{TEXT}\n{table(rows)}\n")


def table(rows: Sequence[Row]) -> str:
    """Return the rows as a table in Markdown."""
    lines = [f"| {' | '.join(('motion', 'who', *COLUMNS))} |", "|---" * (len(COLUMNS) + 2) + "|"]
    for one in sorted(rows, key=lambda r: (r["motion"], r["who"])):
        cells = [one["motion"], one["who"], *(shown(one[name]) for name in COLUMNS)]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def shown(value: Any) -> str:
    """Return a cell."""
    if value is None or value != value:
        return "-"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    with errors_in_one_line():
        main()
