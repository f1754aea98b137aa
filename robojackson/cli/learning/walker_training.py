"""Train the walkers that trainings start from, from files to files, without importing Prefect.

`paper` learns Humanoid-v5's own reward from the first 45 of its observations; the saved file takes
all 348, the others with weight zero. `track` imitates the bundled walk, on any robot; the walker of
a robot for which none ships is saved where `start: walker` finds it.
"""

import hashlib
import shlex
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robojackson.cli import stages
from robojackson.cli.learning import training_process
from robojackson.errors import BadConfiguration, RejectedReference
from robojackson.files import tables
from robojackson.files.file_tree import results_in
from robojackson.files.json_types import to_json
from robojackson.pipeline.bundled_clips import bundled
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.yaml_loader import load

if TYPE_CHECKING:
    from robojackson.robot.description import RobotDescription
    from robojackson.robot.model import Robot

Figures = dict[str, Any]
WALK, STANDING = "walk.mp4", "standing.parquet"
ROBOT, PIPELINE = "humanoid", "base"
"""Names of the configurations that make a walker, besides that of its training."""
CURVE_POINTS, DIGITS = 20, 8


def pretrain(
    kind: str,
    out: Path,
    reference: Path | None,
    overrides: Mapping[str, object],
    robot: str | None = None,
) -> Figures:
    """Train a walker: walker_<kind>.safetensors and walker.json with command, curve, evaluation.

    Raises:
        BadConfiguration: a reference motion or a robot for `paper`, whose walker is Humanoid-v5
            and follows no motion.
    """
    from robojackson.rl.config.train_config import TrainConfig
    from robojackson.rl.policy import load_policy
    from robojackson.rl.sim.stock_humanoid import stock_observation_size
    from robojackson.rl.tqc.network_arrays import load_networks, widened

    _require_fitting(
        kind, load(TrainConfig, f"setups/walker-{kind}", overrides).mode, reference, robot
    )
    machine = _robot(reference, robot)
    motion = reference or _reference(kind, out, machine)
    given = None if reference is not None and robot is None else robot or ROBOT
    stands = kind == "paper"  # a standing motion has no score card
    trained = training_process.train(
        motion, out, f"walker-{kind}", overrides, move="walk", force=stands, robot=given
    )
    networks = load_networks(out / "networks.safetensors")
    policy = load_policy(out / "policy.safetensors")
    if kind == "paper":
        model = machine.model
        size = stock_observation_size(model.nq, model.nv, model.nbody)
        networks = widened(networks, size)
        evaluated = _evaluate_walk(policy, machine)
    else:
        evaluated = stages.evaluate(out / "policy.safetensors", motion, out, PIPELINE, {}, given)
    made = out / f"walker_{kind}.safetensors"
    words = ["--kind", kind, "-o", str(out), *_command_options(overrides)]
    words += [] if reference is None else ["--reference", str(reference)]
    words += [] if robot is None else ["--robot", robot]
    facts = {
        "command": shlex.join(["robojackson", "pretrain", *words]),
        "seed": trained["seed"],
        "steps": trained["steps"],
        "updates": trained["updates"],
        "curve": curve(out),
        "evaluation": evaluated,
    }
    with results_in(out) as files:
        files.write(made.name, networks.to_bytes())
        files.write("walker.json", to_json(facts))
    return {"walker": str(made)} | _installed(made, machine.description, kind) | facts


def _robot(reference: Path | None, robot: str | None) -> "Robot":
    """Return the given robot, else that of the motion, else the paper's."""
    from robojackson.api.arguments import read_if_path, robot_of
    from robojackson.motion.reference_motion import ReferenceMotion
    from robojackson.robot.model import load_robot

    if robot is None and reference is not None:
        return robot_of(read_if_path(ReferenceMotion, reference))
    return load_robot(describe_robot(robot or ROBOT))


def _installed(made: Path, robot: "RobotDescription", kind: str) -> Figures:
    """Save the walker of a robot for which none ships, where `start: walker` finds it."""
    from robojackson.rl.walkers import is_shipped, keep_walker

    if is_shipped(robot, kind):
        return {}
    return {"kept": str(keep_walker(robot, kind, made.read_bytes()))}


def _require_fitting(kind: str, mode: str, reference: Path | None, robot: str | None) -> None:
    """Raise for settings that do not fit the kind of walker.

    Raises:
        BadConfiguration: another mode; a reference motion or another robot for `paper`.
    """
    if mode != kind:
        raise BadConfiguration(f"mode={mode}: the walker of kind {kind!r} learns in mode {kind}")
    if kind == "paper" and reference is not None:
        raise BadConfiguration(
            f"--reference {reference}: the walker of kind 'paper' follows no motion; leave it out, "
            "or take --kind track"
        )
    if kind == "paper" and robot not in (None, ROBOT):
        raise BadConfiguration(
            f"--robot {robot}: the walker of kind 'paper' is {ROBOT}; take --kind track"
        )


def curve(out: Path) -> list[dict[str, float]]:
    """Return mean return and survival of the episodes in equal parts of the training."""
    from robojackson.pipeline.table_schemas import EPISODE_RECORD

    path = out / "episodes.parquet"
    rows = tables.decode_rows(EPISODE_RECORD, path.read_bytes(), str(path))
    parts = np.array_split(np.arange(len(rows)), min(CURVE_POINTS, max(1, len(rows))))

    def mean(part: np.ndarray, key: str) -> float:
        return float(np.mean([rows[i][key] for i in part]))

    return [
        {
            "step": float(rows[part[-1]]["step"]),
            "episode_return": mean(part, "episode_return"),
            "survived_s": mean(part, "survived_s"),
        }
        for part in parts
        if len(part)
    ]


def _reference(kind: str, out: Path, robot: "Robot") -> Path:
    """Return the motion that a walker is trained on: none for `paper`, the bundled walk for
    `track`."""
    from robojackson.rl.modes.standing_motion import make_standing_motion
    from robojackson.robot.description import description_sha256

    if kind == "paper":
        with results_in(out) as files:
            files.write(STANDING, tables.encode(make_standing_motion(robot)))
        return out / STANDING
    made_for = description_sha256(robot.description, robot.joint_names) + robot.sha256
    digest = hashlib.sha256(made_for.encode()).hexdigest()[:DIGITS]
    folder = out / f"{Path(WALK).stem}-{digest}"  # apart from the user's files in `out`
    made = folder / "reference.parquet"
    if not made.exists():
        stages.mocap(bundled(WALK), folder, PIPELINE, {})
        named = {"robot": robot.description.file or robot.description.name}
        try:
            stages.retarget(folder / "smpl.parquet", folder, PIPELINE, named)
        except RejectedReference as cause:
            made.unlink(missing_ok=True)
            raise RejectedReference(
                f"{robot.description.name} cannot follow the bundled walk: {cause.reason}",
                "give a motion that it can follow: --reference REFERENCE",
            ) from cause
    return made


def _evaluate_walk(policy: Any, robot: "Robot") -> Figures:
    from robojackson.rl.evaluation.walking import walk

    return asdict(walk(policy, robot))


def _command_options(overrides: Mapping[str, object]) -> list[str]:
    """Return the options of a command that override the setup."""
    options = {"steps": "--steps", "minutes": "--minutes", "seed": "--seed", "trainer": "--trainer"}
    words: list[str] = []
    for key, value in overrides.items():
        words += [options[key], str(value)] if key in options else ["--set", f"{key}={value}"]
    return words
