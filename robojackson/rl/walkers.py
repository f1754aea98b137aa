"""The shipped networks that a training begins from: walkers (`start: walker`), and the dancer.

The shipped walkers were trained on one robot. `robojackson pretrain --robot NAME` saves that of any
other robot beside the added robots, by the robot's name, the digest of its model and the mode. The
dancer (`start: dancer`) was trained on many motions, for one robot.
"""

from pathlib import Path

from robojackson.errors import BadPolicy
from robojackson.files.file_tree import FileTree
from robojackson.rl.policy import load_policy
from robojackson.rl.tqc.network_arrays import load_networks
from robojackson.robot.description import RobotDescription
from robojackson.robot.mjcf import mjcf_path, model_sha256, robots_folder

ASSETS = Path(__file__).parent.parent / "assets"
WALKERS = {"track": "walker_track.safetensors", "paper": "walker_paper.safetensors"}
DANCER = "dancer_g1.safetensors"
STARTS = ("walker", "dancer")
"""Words that a training's `start` has for shipped networks, of which not every robot has one."""
SCRATCH = "scratch"
FOLDER = "pretrain"
DIGITS = 12
"""Number of digits of the model's digest in the name of a walker's folder."""


def start_name(start: str) -> str:
    """Return how a training records its start: without folders, but for a file that would then read
    as a shipped network."""
    name = Path(start).name
    return start if name in (SCRATCH, *STARTS) else name


def shipped_walker(mode: str) -> Path:
    """Return the file of the walker that ships for a mode."""
    return ASSETS / WALKERS[mode]


def is_shipped(robot: RobotDescription, mode: str) -> bool:
    """Return whether the shipped walker of a mode fits this robot: it was trained on it, or on its
    model with all of its hinges.

    Raises:
        BadConfiguration: the model of the robot is not installed.
    """
    facts = load_networks(shipped_walker(mode)).facts
    is_same = facts.get("model_sha256") == _model(robot) and not robot.fixed_joints
    return facts.get("robot") == robot.name or is_same


def shipped_dancer(robot: RobotDescription | None, mode: str) -> Path:
    """Return the file of the dancer, which was trained on many motions of one robot.

    Raises:
        BadConfiguration: the model of the robot is not installed.
        BadPolicy: it was trained on another robot or model, or in another mode.
    """
    path, rest = ASSETS / DANCER, "take --setup scratch or pretrain"
    facts = load_policy(path).facts
    if robot is None or robot.name != facts.get("robot"):
        given = "the robot of this training" if robot is None else repr(robot.name)
        raise BadPolicy(f"start 'dancer' is for robot {facts.get('robot')!r}, not {given}: {rest}")
    if mode != facts.get("mode"):
        raise BadPolicy(f"start 'dancer' is for mode {facts.get('mode')}, not {mode}: {rest}")
    if facts.get("model_sha256") != _model(robot):
        raise BadPolicy(f"start 'dancer' was trained on another model of {robot.name!r}: {rest}")
    return path


def walker_file(robot: RobotDescription, mode: str) -> Path:
    """Return the file of a robot's own walker, else of the shipped one that fits it.

    Raises:
        BadConfiguration: the model of the robot is not installed.
        BadPolicy: there is no walker; the message names the command that trains one.
    """
    own = walkers_root() / walker_key(robot, mode)
    if own.is_file():
        return own
    if is_shipped(robot, mode):
        return shipped_walker(mode)
    if mode != "track":
        raise BadPolicy(
            f"start 'walker': mode {mode} has no walker for robot {robot.name!r}; take mode=track "
            "or a setup that starts from scratch"
        )
    named = robot.file or robot.name
    raise BadPolicy(
        f"start 'walker': robot {robot.name!r} has no walker yet; run: "
        f"robojackson pretrain --robot {named} -o walker_{robot.name}"
    )


def keep_walker(robot: RobotDescription, mode: str, content: bytes) -> Path:
    """Write the walker that trainings of this robot start from; return its file.

    Raises:
        StoreError: it cannot be written.
    """
    FileTree(walkers_root()).write(walker_key(robot, mode), content)
    return walkers_root() / walker_key(robot, mode)


def walker_key(robot: RobotDescription, mode: str) -> str:
    """Return the key of a robot's own walker in a store.

    Raises:
        BadConfiguration: the model of the robot is not installed.
    """
    return f"{FOLDER}/{robot.name}-{_model(robot)[:DIGITS]}/{WALKERS[mode]}"


def walkers_root() -> Path:
    """Return the folder whose `pretrain` holds walkers: the store, or its cache if it is not a
    folder."""
    return robots_folder().parent


def _model(robot: RobotDescription) -> str:
    return model_sha256(mjcf_path(robot))
