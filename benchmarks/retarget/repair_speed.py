"""Cost of retargeting with repair, tempo and certificate: CPU seconds a second of clip.

    python -m benchmarks.retarget.repair_speed --robots humanoid g1 --lengths 2 10 30 60

A clip goes back and forth until it has the length of its row. Each row has a measure beside it that
is independent of the code under test: `mj_inverse` calls a CPU second on the robot's model, taken
just before and after the row on the same core, since a busy machine slows both down.
"""

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from rich.console import Console

from benchmarks.retarget.truth_motions import lengthened, truth_motion
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.retargeting import retarget_motion
from robojackson.robot.model import Robot, load_robot

RESULTS = Path(__file__).parents[1] / "results" / "retarget_speed.json"
LENGTHS_S = (2.0, 10.0, 30.0, 60.0)
BARS = {"humanoid": 1.0, "g1": 1.5}
FIGURES = ("seconds", "keypoint_mm", "infeasible_share", "tempo_mean", "passed")
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


def rows_of(robot: Robot, clip: str, lengths: list[float]) -> Iterator[dict[str, Any]]:
    """Yield one row a length."""
    for seconds in lengths:
        sequence = lengthened(truth_motion(clip), seconds)
        before, started = ruler(robot), time.process_time()
        card = retarget_motion(sequence, robot, RetargetConfig(cyclic="no")).scorecard
        spent = time.process_time() - started
        calls = (before + ruler(robot)) / 2
        yield {
            "robot": robot.description.name,
            "clip": clip,
            "clip_s": seconds,
            "cpu_s": spent,
            "cpu_s_per_s": spent / seconds,
            "bar": BARS.get(robot.description.name),
            "inverse_calls_per_s": calls,
            "inverse_calls": spent * calls / seconds,
            **{name: card[name] for name in FIGURES},
        }


def main(arguments: list[str] | None = None) -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", nargs="*", default=["humanoid", "g1"])
    parser.add_argument("--clip", default="dance_b")
    parser.add_argument("--lengths", nargs="*", type=float, default=list(LENGTHS_S))
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args(arguments)
    console, rows = Console(width=200), []
    for name in options.robots:
        for row in rows_of(load_robot(describe_robot(name)), options.clip, options.lengths):
            rows.append(row)
            console.print({key: round(v, 3) if isinstance(v, float) else v
                           for key, v in row.items()})  # fmt: skip
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps({"rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
