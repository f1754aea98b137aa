"""Experts that teach the dancer: linear feedback along a path beside each motion.

    python -m tools.dancer.experts REFERENCES OUT [--tries 2] [--part 0/2]

An expert knows the whole state and one motion (`rl.sim.sampled_regulator`); its nominal path moves
along the floor to where the robot's feet stand, as a dancer without a position sensor needs it.
OUT gets one file of gains a motion; existing ones stay.
"""

import argparse
import time
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from robojackson import load_robot
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.motors import residual_scale
from robojackson.rl.sim.nominal_path import Gains
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.sampled_regulator import sampled_regulator
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.sim.standing_feet import Feet
from robojackson.robot.model import Robot

CONTROL = ControlConfig(feedforward=1.0, feedback=0.0)
"""The control law that an expert moves the targets of."""


def expert(robot: Robot, motion: ReferenceMotion, tries: int) -> Gains:
    """Compute the feedback of one motion.

    Args:
        tries: Searches for a path at most.
    """
    sim, feet = Simulation(robot, CONTROL, 1), Feet(robot)
    clip = Clip(motion, lead_of(robot, motion, CONTROL))
    action = residual_scale(robot, ControlConfig())
    found = sampled_regulator(robot, sim, clip, action, most_tries=tries)
    return replace(found, places=feet.places(found.qpos))


def save(gains: Gains, path: Path) -> None:
    """Write the feedback of one motion, numbers of four bytes."""
    arrays = {one.name: getattr(gains, one.name).astype(np.float32) for one in fields(Gains)}
    part = path.with_suffix(".part.npz")
    np.savez(part, **arrays)
    part.replace(path)


def load(path: Path) -> Gains:
    """Read the feedback of one motion."""
    with np.load(path) as arrays:
        return Gains(*(arrays[one.name].astype(float) for one in fields(Gains)))


def main() -> None:
    """Compute the experts that are missing."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("references", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--robot", default="g1")
    parser.add_argument("--tries", type=int, default=2)
    parser.add_argument("--part", default="0/1", help="i/n: every n-th motion from the i-th")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    robot = load_robot(given.robot)
    first, step = map(int, given.part.split("/"))
    for reference in sorted(given.references.glob("*.parquet"))[first::step]:
        path = given.out / f"{reference.stem}.npz"
        if not path.is_file():
            motion, began = ReferenceMotion.load(reference), time.process_time()
            save(expert(robot, motion, given.tries), path)
            spent = time.process_time() - began
            print(f"{path.stem}: {len(motion) * motion.dt:.1f} s, {spent:.0f} CPU-s", flush=True)


if __name__ == "__main__":
    main()
