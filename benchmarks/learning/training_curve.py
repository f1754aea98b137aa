"""Curve of a training: seconds survived by training episodes against CPU seconds and steps.

A process of its own, so that its CPU time is its own:

    python -m benchmarks.learning.training_curve REFERENCE OUT.json --until 5 --cpu-minutes 10

It ends at its CPU minutes, or as soon as the mean survival of the last hundred episodes is reached.
Nothing is resumed: a curve that was broken off is measured again.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[2]
RECENT = 100
"""Episodes that a mean survival is taken over."""
STOCK = (*("trainer=sb3", "tqc.preset=paper", "tqc.steps_per_round=1", "tqc.updates_per_round=1"),)
"""sb3-contrib's own defaults: one robot, one update a step."""


@dataclass
class Curve:
    """Points of a training.

    Attributes:
        points: (CPU s, steps, mean s survived by the last hundred episodes).
    """

    until: float
    points: list[tuple[float, int, float]] = field(default_factory=list)
    _recent: deque[float] = field(default_factory=lambda: deque(maxlen=RECENT))
    _began: float = field(default_factory=time.process_time)

    def add(self, rows: list[dict[str, float]]) -> None:
        """Count episodes that ended."""
        self._recent.extend(row["survived_s"] for row in rows)
        spent = time.process_time() - self._began
        if not self.points or spent - self.points[-1][0] >= 1.0 or self.reached():
            self.points.append((spent, int(rows[-1]["step"]), float(np.mean(self._recent))))

    def reached(self) -> bool:
        """Return whether the target mean survival is reached."""
        return len(self._recent) == RECENT and float(np.mean(self._recent)) >= self.until


def measure(reference: Path, out: Path, options: list[str], until: float, minutes: float) -> None:
    """Train in this process and write the curve."""
    from robojackson.api.arguments import robot_of
    from robojackson.motion.reference_motion import ReferenceMotion
    from robojackson.pipeline.yaml_loader import load
    from robojackson.rl.config.train_config import TrainConfig
    from robojackson.rl.training import Hooks, train_policy

    fixed = {"cpu_minutes": minutes, "checkpoint_seconds": 1e5, "track.threads": 1}
    config = load(TrainConfig, None, {**dict(o.split("=", 1) for o in options), **fixed})
    motion = ReferenceMotion.load(reference)
    curve = Curve(until)
    with tempfile.TemporaryDirectory() as folder:
        hooks = Hooks(sink=curve.add, stop=curve.reached)
        try:
            train_policy(motion, robot_of(motion), config, Path(folder), hooks)
        except KeyboardInterrupt:
            if not curve.reached():
                raise
    record = {"options": options, "reached": curve.reached(), "points": curve.points}
    out.parent.mkdir(parents=True, exist_ok=True)
    part = out.with_suffix(".part")
    part.write_text(json.dumps(record))
    part.replace(out)


def curve_of(
    reference: Path, out: Path, options: list[str], until: float, minutes: float
) -> dict[str, Any]:
    """Return the curve of a training, measured in a process on one core unless it is there
    already."""
    if not out.exists():
        line = [
            sys.executable,
            "-m",
            "benchmarks.learning.training_curve",
            str(reference),
            str(out),
        ]
        line += [f"--until={until}", f"--cpu-minutes={minutes}", *(f"--set={o}" for o in options)]
        if shutil.which("taskset"):
            line = ["taskset", "-c", str(min(os.sched_getaffinity(0))), *line]
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        subprocess.run(line, check=True, cwd=ROOT, env=environment)
    found: dict[str, Any] = json.loads(out.read_text())
    return found


def area(points: list[tuple[float, int, float]], seconds: float) -> float:
    """Return the mean of the survival over the first CPU seconds, s: the area under the curve over
    its width.

    Before its first point nothing survives; after its last it stays.
    """
    at = np.linspace(0, seconds, 1000)
    spent, _, survived = (np.array(column, float) for column in zip(*points, strict=True))
    return float(np.mean(np.interp(at, spent, survived, left=0.0)))


def first_at(points: list[tuple[float, int, float]], level: float) -> float | None:
    """Return CPU seconds at which a survival is first reached."""
    return next((spent for spent, _, survived in points if survived >= level), None)


def main() -> None:
    """Measure one curve."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("reference", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--set", action="append", default=[], dest="options")
    parser.add_argument("--until", type=float, default=float("inf"))
    parser.add_argument("--cpu-minutes", type=float, required=True)
    given = parser.parse_args()
    measure(given.reference, given.out, given.options, given.until, given.cpu_minutes)


if __name__ == "__main__":
    main()
