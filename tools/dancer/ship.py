"""Write the dancer's policy file, which `configs/trackers/dancer.yaml` names, from its training.

python -m tools.dancer.ship OUT/dancer.npz -o robojackson/assets/dancer_g1.safetensors \
        --seed 0 --motions 125 [--robot g1] [--sees everything]
"""

import argparse
import json
from dataclasses import asdict
from pathlib import Path

import torch

from robojackson import load_robot
from robojackson.files.local_folder import sha256_of_file
from robojackson.rl.config.train_config import TrackConfig
from robojackson.rl.modes.observation import Kind, Observer
from robojackson.rl.policy import Policy
from robojackson.rl.sim.motors import actuation_facts
from robojackson.rl.sim.simulation import resolved
from robojackson.robot.model import Robot
from tools.dancer.network import Dancer, hidden_of, restore
from tools.dancer.pack import CONTROL

KINDS: dict[str, Kind] = {"sensors": "preview", "everything": "full_preview"}
"""What `learn --sees` names."""


def facts(robot: Robot, kind: Kind, seed: int, steps: int, motions: int) -> dict[str, object]:
    """Return the facts of a policy's file."""
    control = resolved(CONTROL, robot)
    environment = json.loads(json.dumps(asdict(TrackConfig(observation=kind, control=CONTROL))))
    return {
        "robot": robot.description.name, "model_sha256": robot.sha256, "mode": "track",
        "trainer": "ppo", "seed": seed, "setup": "dancer", "start": "scratch",
        "curiosity": "off", "steps": steps, "motions": motions, "control": asdict(control),
        "actuation": actuation_facts(robot, control), "repeats": 1, "environment": environment,
    }  # fmt: skip


def policy_of(file: Path, robot: Robot, kind: Kind, seed: int, motions: int) -> Policy:
    """Return the policy of a training's `dancer.npz`."""
    observer = Observer(robot, kind)
    dancer = Dancer(observer.actor_size, observer.size, robot.model.nu, hidden_of(file))
    steps = restore(dancer, file)
    return Policy(tuple(dancer.layers()), facts(robot, kind, seed, steps, motions))


def main() -> None:
    """Write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("training", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--robot", default="g1")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--sees", choices=KINDS, default="sensors")
    parser.add_argument("--motions", type=int, required=True)
    given = parser.parse_args()
    torch.set_num_threads(1)
    policy = policy_of(
        given.training, load_robot(given.robot), KINDS[given.sees], given.seed, given.motions
    )
    path = policy.save(given.out)
    print(f"{path}: {policy!r}, size {path.stat().st_size}, sha256 {sha256_of_file(path)}")


if __name__ == "__main__":
    main()
