"""Distil experts of single motions into one network that follows any motion.

    python -m tools.dancer.distil REFERENCES EXPERTS -o OUT [--rounds 80] [--seed 0]

DAgger: in every round robots rehearse all motions, more and more of them driven by the network
itself, and the network learns from all advice so far. OUT gets `policy.safetensors` (a policy
whose observation is `preview`), `networks.safetensors` to train on from, and `curve.csv`; a run
that was interrupted goes on.
"""

import argparse
import csv
import json
import time
from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch

from benchmarks.learning.split import load_split
from robojackson import load_robot
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import TrackConfig
from robojackson.rl.policy import Policy
from robojackson.rl.sim.motors import actuation_facts
from robojackson.rl.sim.nominal_path import Gains
from robojackson.rl.sim.simulation import resolved
from robojackson.rl.tqc.network_arrays import Networks
from robojackson.robot.model import Robot
from tools.dancer import experts
from tools.dancer.imitation import Memory, Student
from tools.dancer.mirror import ObservationMirror
from tools.dancer.rehearsal import CONTROL, Rehearsal

ROBOTS, STEPS, UPDATES, MEMORY = 128, 250, 400, 1_200_000
RATES = (1e-3, 1e-4)
"""Adam's step in the first and the last round, geometric between."""
TAUGHT = 3
"""Rounds whose robots the experts drive; then the network drives a growing share."""
MOST_ALONE = 0.9
HIDDEN = (512, 384, 256)


def taught(references: Path, gains: Path) -> tuple[list[ReferenceMotion], list[Gains]]:
    """Return the motions that have an expert, and the experts.

    Raises:
        ValueError: one of the motions is held out, or too similar to one that is.
    """
    names = sorted(path.stem for path in gains.glob("*.npz"))
    load_split().require_none_held_out(names)
    motions = [ReferenceMotion.load(references / f"{name}.parquet") for name in names]
    return motions, [experts.load(gains / f"{name}.npz") for name in names]


def share_alone(number: int) -> float:
    """Return the share of the episodes of a round that the network drives."""
    return 0.0 if number < TAUGHT else min(MOST_ALONE, 0.3 + 0.06 * (number - TAUGHT))


def facts(robot: Robot, seed: int, rounds: int, steps: int, motions: int) -> dict[str, object]:
    """Return the facts of a policy's file."""
    control = resolved(CONTROL, robot)
    environment = json.loads(
        json.dumps(asdict(TrackConfig(observation="preview", control=CONTROL)))
    )
    return {
        "robot": robot.description.name, "model_sha256": robot.sha256, "mode": "track",
        "trainer": "dagger", "seed": seed, "setup": "dancer", "start": "scratch",
        "curiosity": "off", "steps": steps, "updates": rounds * UPDATES, "motions": motions,
        "control": asdict(control), "actuation": actuation_facts(robot, control), "repeats": 1,
        "environment": environment,
    }  # fmt: skip


def save(out: Path, student: Student, known: dict[str, object]) -> None:
    """Write the policy, and the networks that a training can start from."""
    layers = student.layers()
    (out / "policy.safetensors").write_bytes(Policy(layers, known).to_bytes())
    named = {f"actor.{i}": layer for i, layer in enumerate(layers[:-1])} | {"mean": layers[-1]}
    tensors = {
        f"{name}.{part}": array
        for name, layer in named.items()
        for part, array in zip(("weight", "bias"), layer, strict=True)
    }
    (out / "networks.safetensors").write_bytes(Networks(tensors, known).to_bytes())


def main() -> None:
    """Distil until all rounds are done."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("references", type=Path)
    parser.add_argument("experts", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--robot", default="g1")
    parser.add_argument("--rounds", type=int, default=80)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    robot = load_robot(given.robot)
    motions, gains = taught(given.references, given.experts)
    print(f"{len(motions)} motions, {sum(len(m) * m.dt for m in motions):.0f} s", flush=True)
    lessons_of = Rehearsal(robot, motions, gains, ROBOTS, given.seed)
    size, motors = lessons_of.size
    student = Student(size, motors, HIDDEN, ObservationMirror.of(robot), given.seed)
    memory, rng = Memory(MEMORY, size, motors), np.random.default_rng(given.seed)
    for number in range(given.rounds):
        part = number / max(1, given.rounds - 1)
        rate = float(RATES[0] * (RATES[1] / RATES[0]) ** part)
        lessons = lessons_of.run(student.act, share_alone(number), STEPS)
        memory.add(lessons, rng)
        loss = student.learn(memory, UPDATES, rate, rng)
        row = [
            number,
            memory.count,
            share_alone(number),
            lessons.survived,
            loss,
            time.process_time(),
        ]
        print(" ".join(f"{value:.4g}" for value in row), flush=True)
        with (given.out / "curve.csv").open("a", newline="") as file:
            csv.writer(file).writerow(row)
        steps = (number + 1) * ROBOTS * STEPS
        save(given.out, student, facts(robot, given.seed, number + 1, steps, len(motions)))


if __name__ == "__main__":
    torch.set_num_threads(1)
    main()
