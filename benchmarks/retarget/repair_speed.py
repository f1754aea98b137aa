"""Cost of retargeting with repair, tempo and certificate: CPU seconds a second of clip.

    python -m benchmarks.retarget.repair_speed --robots humanoid g1 --lengths 2 10 30 60
    python -m benchmarks.retarget.repair_speed --clips dance_b FOLDER/smpl.parquet --beside CHECKOUT

A clip goes back and forth until it has the length of its row; 0 leaves it as it is. Each row has a
measure beside it that is independent of the code under test: `mj_inverse` calls a CPU second on the
robot's model, taken just before and after the row on the same core, since a busy machine slows both
down. With another checkout beside it, both measure each row in turn, in processes of their own.
Rows are written as they come; one that the file has already is not measured again.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import mujoco
import numpy as np
from rich.console import Console

from benchmarks.retarget.truth_motions import lengthened, truth_motion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.retarget import danced_motion, retargeting
from robojackson.retarget.feasibility import tempo
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.robot.model import Robot, load_robot

ROOT = Path(__file__).parents[2]
RESULTS = Path(__file__).parents[1] / "results" / "retarget_speed.json"
LENGTHS_S = (3.0, 8.0, 15.0, 60.0)
BARS = {"humanoid": 1.0, "g1": 1.5}
FIGURES = ("seconds", "keypoint_mm", "infeasible_share", "tempo_mean", "passed")
STAGES = {
    "tails": (danced_motion, "with_tails"),
    "solve": (danced_motion, "optimise"),
    "sway": (danced_motion, "_over_the_feet"),
    "repair": (danced_motion, "make_feasible"),
    "tempo": (tempo, "slacks"),
    "certificate": (retargeting, "certify"),
}
"""Stages, and the functions that they are; what no stage takes is the score card."""
KEY = ("code", "robot", "clip", "clip_s")
_CALLS = 4000


def ruler(robot: Robot) -> float:
    """Return `mj_inverse` calls a CPU second in a pose that moves."""
    model, data = robot.model, mujoco.MjData(robot.model)
    rng = np.random.default_rng(0)
    data.qpos[:] = robot.standing
    data.qvel[:], data.qacc[:] = rng.normal(size=(2, model.nv))
    started = time.process_time()
    for _ in range(_CALLS):
        mujoco.mj_inverse(model, data)
    return _CALLS / (time.process_time() - started)


@contextmanager
def clocked() -> Iterator[dict[str, float]]:
    """Yield the CPU seconds of each stage, without those of the stages inside it."""
    spent, inner = dict.fromkeys(STAGES, 0.0), [0.0]

    def timed(stage: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def run(*arguments: Any, **named: Any) -> Any:
            started = time.process_time()
            inner.append(0.0)
            try:
                return call(*arguments, **named)
            finally:
                whole = time.process_time() - started
                spent[stage] += whole - inner.pop()
                inner[-1] += whole

        return run

    patches = [
        mock.patch.object(module, name, timed(stage, getattr(module, name)))
        for stage, (module, name) in STAGES.items()
    ]
    for patch in patches:
        patch.start()
    try:
        yield spent
    finally:
        for patch in patches:
            patch.stop()


def clip_of(name: str, seconds: float) -> SmplSequence:
    """Return a bundled clip's true motion, or that of a file, for so many seconds; 0 for all."""
    path = Path(name)
    sequence = SmplSequence.load(path) if path.suffix == ".parquet" else truth_motion(name)
    return lengthened(sequence, seconds) if seconds else sequence


def row_of(robot: Robot, clip: str, seconds: float, code: str) -> dict[str, Any]:
    """Return the row of a clip and a length."""
    sequence = clip_of(clip, seconds)
    length = len(sequence) / sequence.fps
    before, started = ruler(robot), time.process_time()
    with clocked() as spent:
        card = retargeting.retarget_motion(sequence, robot, RetargetConfig(cyclic="no")).scorecard
    cpu = time.process_time() - started
    calls = (before + ruler(robot)) / 2
    path, name = Path(clip), robot.description.name
    return {
        "code": code,
        "robot": name,
        "clip": path.parent.name if path.suffix else clip,
        "clip_s": seconds or round(length, 2),
        "cpu_s": cpu,
        "cpu_s_per_s": cpu / length,
        "bar": BARS.get(name),
        "inverse_calls_per_s": calls,
        "inverse_calls": cpu * calls / length,
        **{f"{stage}_s": taken for stage, taken in spent.items()},
        **{figure: card[figure] for figure in FIGURES},
    }


def beside(checkout: Path, robot: str, clip: str, seconds: float, code: str) -> dict[str, Any]:
    """Return the row that another checkout measures with this module, in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "row.json"
        given = ["--robots", robot, "--clips", clip, "--lengths", str(seconds)]
        start = f"import sys; sys.path.insert(0, {str(checkout)!r}); import runpy; "
        start += f"runpy.run_path({str(Path(__file__))!r}, run_name='__main__')"
        subprocess.run(
            [sys.executable, "-c", start, *given, "--code", code, "--out", str(out)],
            cwd=checkout,
            check=True,
            stdout=subprocess.DEVNULL,
        )
        row: dict[str, Any] = json.loads(out.read_text())["rows"][0]
        return row


def main(arguments: list[str] | None = None) -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--robots", nargs="*", default=["humanoid", "g1"])
    parser.add_argument("--clips", nargs="*", default=["dance_b"])
    parser.add_argument("--lengths", nargs="*", type=float, default=list(LENGTHS_S))
    parser.add_argument("--code", default="now", help="name of this code in the rows")
    parser.add_argument("--beside", type=Path, help="another checkout, whose rows say before")
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args(arguments)
    console = Console(width=200)
    rows = json.loads(options.out.read_text())["rows"] if options.out.is_file() else []
    for name in options.robots:
        for clip in options.clips:
            for seconds in options.lengths:
                for row in _rows(rows, name, clip, seconds, options):
                    rows.append(row)
                    _write(options.out, rows)
                    console.print({key: round(value, 3) if isinstance(value, float) else value
                                   for key, value in row.items()})  # fmt: skip


def _rows(
    rows: list[dict[str, Any]], name: str, clip: str, seconds: float, options: argparse.Namespace
) -> Iterator[dict[str, Any]]:
    """Yield the rows of a clip and a length that are not measured yet."""
    path = Path(clip)
    label = path.parent.name if path.suffix else clip
    checkouts: Mapping[str, Path] = {options.code: ROOT}
    if options.beside:
        checkouts = {"before": options.beside.absolute(), **checkouts}
    for code, checkout in checkouts.items():
        if seconds and (code, name, label, seconds) in [
            tuple(row.get(key) for key in KEY) for row in rows
        ]:
            continue
        given = str(path.absolute()) if path.suffix else clip
        if options.beside:
            yield beside(checkout, name, given, seconds, code)
        else:
            yield row_of(load_robot(describe_robot(name)), given, seconds, code)


def _write(path: Path, rows: list[dict[str, Any]]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
