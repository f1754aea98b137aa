"""Train the dancer: one policy on top of the feedback along many motions.

    python -m tools.dancer.residual REFERENCES -o OUT --steps 1500000 [--seed 0] [--without NAME...]

REFERENCES holds reference motions (`tools.dancer.library`); a captured one that the split file does
not list for training is refused. Motions that the feedback alone does not hold are passed over; of
the others it learns the mirror images, too.
The policy sees a robot's own measurements as differences from the next step of the reference; what
comes after that step is in the gains of the feedback (residual policy learning: Silver et al.,
2018). The same command goes on where a run was stopped. OUT gets `dancer.safetensors`, which
`configs/trackers/dancer.yaml` names, `networks.safetensors`, which a training may start from, and
`curve.csv`.
"""

import argparse
import csv
import logging
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from robojackson import load_robot
from robojackson.files.local_folder import sha256_of_file
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig, TqcConfig, TrackConfig, TrainConfig
from robojackson.rl.feedback.cached_feedback import feedback_of, keep_feedback
from robojackson.rl.modes.track_mode import control_of
from robojackson.rl.policy import load_policy
from robojackson.rl.tqc.network_arrays import load_networks
from robojackson.rl.training import train_policy
from robojackson.rl.training_hooks import Hooks, Row
from robojackson.robot.model import Robot
from tools.dancer.mirror import Images
from tools.dancer.pack import collection

log = logging.getLogger(__name__)

LEAST_HELD = 0.3
"""Share of its starts from which the feedback, of the exact root, has to hold a motion."""
BUFFER = 1_000_000
"""Steps to learn from: of minutes of many motions, not of the last one (2 GB)."""
MIRRORED = "_mirrored"
"""How the name of a mirror image ends."""
COLUMNS = ("steps", "survived_s", "site_error_m", "episode_return")
OF_ONE_MOTION = ("reference_sha256", "feedback_outline")
"""Facts of a training that name its motion."""


def configuration(steps: int, seed: int) -> TrainConfig:
    """Return the training: a polish on feedback from the estimated root."""
    law = ControlConfig(feedback_path="sampled")
    track = TrackConfig(observation="onboard", differences=True, control=law)
    tqc = TqcConfig(preset="polish", buffer=BUFFER)
    return TrainConfig(steps=steps, seed=seed, track=track, tqc=tqc)


def held(robot: Robot, named: Mapping[str, ReferenceMotion]) -> dict[str, ReferenceMotion]:
    """Return the motions that the feedback along them holds, and their mirror images; the feedback
    is computed where it is not in the store."""
    law, kept = control_of(configuration(1, 0).track), dict[str, ReferenceMotion]()
    images = Images(robot)
    for name, motion in named.items():
        found = feedback_of(robot, [motion], law)
        share = np.nan if found is None else found.held
        log.info("%s: the feedback holds %.0f %% of its starts", name, 100 * share)
        if found is not None and share >= LEAST_HELD:
            image = images.motion(motion)
            keep_feedback(robot, image, law, images.gains(found.gains))
            kept |= {name: motion, f"{name}{MIRRORED}": image}
    return kept


class Curve:
    """The file of the training's progress; a run that goes on adds to it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        if not path.is_file():
            self._add(COLUMNS)

    def add(self, row: Row) -> None:
        """Add a row of progress."""
        log.info("%s", {name: round(float(row[name]), 3) for name in COLUMNS})
        self._add([f"{float(row[name]):.4g}" for name in COLUMNS])

    def _add(self, values: tuple[str, ...] | list[str]) -> None:
        with self._path.open("a", newline="") as file:
            csv.writer(file).writerow(values)


def shipped(out: Path, names: list[str]) -> Path:
    """Write the policy and its networks without what belongs to one motion; return the policy."""
    policy, networks = (
        load_policy(out / "policy.safetensors"),
        load_networks(out / "networks.safetensors"),
    )
    facts = {key: value for key, value in policy.facts.items() if key not in OF_ONE_MOTION}
    facts |= {"motions": names, "setup": "dancer"}
    (out / "networks.safetensors").write_bytes(replace(networks, facts=facts).to_bytes())
    return replace(policy, facts=facts).save(out / "dancer.safetensors")


def main() -> None:
    """Train, or go on."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("references", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--steps", type=int, required=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--robot", default="g1")
    parser.add_argument("--without", nargs="*", default=[], help="motions to leave out")
    given = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    given.out.mkdir(parents=True, exist_ok=True)
    robot, named = load_robot(given.robot), collection(given.references)
    chosen = held(robot, {name: m for name, m in named.items() if name not in given.without})
    hooks = Hooks(progress=Curve(given.out / "curve.csv").add, setup="dancer")
    train_policy(
        list(chosen.values()), robot, configuration(given.steps, given.seed), given.out, hooks
    )
    path = shipped(given.out, list(chosen))
    print(f"size {path.stat().st_size}, sha256 {sha256_of_file(path)}")


if __name__ == "__main__":
    main()
