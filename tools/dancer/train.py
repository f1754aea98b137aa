"""Teach the dancer: one policy that follows every motion of a folder and its mirror image.

    python -m tools.dancer.train REFERENCES -o OUT [--set cpu_minutes=90] [--start NETWORKS]

Interrupted and called again it goes on. OUT gets what a training of one motion gets, and
`episodes.parquet` with a row an episode.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

from benchmarks.learning.split import load_split
from robojackson import load_robot
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.training import Hooks, train_policy
from robojackson.robot.model import Robot
from tools.dancer.mirror import mirrored

SETUP = "setups/dancer"


def collection(folder: Path, robot: Robot) -> list[ReferenceMotion]:
    """Read the motions of a folder, each followed by its mirror image.

    Raises:
        ValueError: one of them is held out, or too similar to one that is.
    """
    paths = sorted(folder.glob("*.parquet"))
    load_split().require_none_held_out(path.stem for path in paths)
    plain = [ReferenceMotion.load(path) for path in paths]
    return [image for motion in plain for image in (motion, mirrored(motion, robot))]


def main() -> None:
    """Train until the budget is used up."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("references", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--set", action="append", default=[], help="section.key=value")
    parser.add_argument("--start", default="scratch", help="networks.safetensors")
    given = parser.parse_args()
    config = replace(
        load(TrainConfig, SETUP, dict(item.split("=", 1) for item in given.set)), start=given.start
    )
    motions = collection(given.references, load_robot("g1"))
    seconds = sum(len(motion) * motion.dt for motion in motions)
    print(f"{len(motions)} motions, {seconds:.0f} s", flush=True)
    began = time.monotonic()

    def report(row: dict[str, float]) -> None:
        figures = " ".join(f"{key} {value:.4g}" for key, value in row.items())
        print(f"{time.monotonic() - began:.0f} s: {figures}", flush=True)

    result = train_policy(motions, load_robot("g1"), config, given.out, Hooks(progress=report))
    print(f"{result.policy}: {result.steps} steps, {result.stopped}")


if __name__ == "__main__":
    main()
