"""Experts of the dancer: for every motion of a pack the linear feedback that holds it.

    python -m tools.dancer.experts REFERENCES -o EXPERTS [--robot g1] [--only NAME...]

EXPERTS gets a file for every reference motion; those that are there stay. Each takes 20 to 30
CPU-seconds a second of motion: the regulator along a path that is searched once and refined once
(`rl.feedback`). Gains are kept in eight binary digits, with a scale for every step and number of
the state. What an expert advises is the label of the states that robots come to (DAgger:
Ross et al., 2011). World frame, metres, radians, seconds.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from robojackson import load_robot
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.feedback.nominal_path import Gains
from robojackson.rl.feedback.sampled_regulator import sampled_regulator
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.motors import residual_scale
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.robot.model import Robot
from tools.dancer.pack import CONTROL, collection

MOST_CODE = 127
"""Largest of the whole numbers that stand for gains."""


def expert_of(robot: Robot, motion: ReferenceMotion) -> Gains:
    """Return the regulator along a path that is searched once and refined once."""
    sim, clip = Simulation(robot, CONTROL, 1), Clip(motion, lead_of(robot, motion, CONTROL))
    action = residual_scale(robot, ControlConfig())
    return sampled_regulator(robot, sim, clip, action, most_tries=1, most_rounds=1)


def _coded(gains: Gains) -> dict[str, np.ndarray]:
    """Return the tables of a motion."""
    width = np.maximum(np.abs(gains.gain).max(1), 1e-12) / MOST_CODE
    code = np.rint(gains.gain / width[:, None]).astype(np.int8)
    rest = {name: getattr(gains, name) for name in ("offset", "qpos", "qvel", "places")}
    tables = {"width": width, **rest}
    return {"code": code, **{name: np.asarray(x, np.float32) for name, x in tables.items()}}


def main() -> None:
    """Compute the experts that are missing."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("references", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--robot", default="g1")
    parser.add_argument("--only", nargs="+", help="names of motions")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    robot, named = load_robot(given.robot), collection(given.references)
    for name in given.only or named:
        path = given.out / f"{name}.npz"
        if path.is_file():
            continue
        began = time.process_time()
        gains = expert_of(robot, named[name])
        part = path.with_suffix(".part.npz")
        np.savez_compressed(part, **_coded(gains))
        part.replace(path)
        seconds = time.process_time() - began
        print(f"{name}: held {gains.held.min():.2f}, {seconds:.0f} CPU-s", flush=True)


if __name__ == "__main__":
    main()
