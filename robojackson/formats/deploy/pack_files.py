"""The files of a deploy pack by name."""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path

from robojackson.errors import BadConfiguration
from robojackson.formats.beyondmimic import motion_arrays
from robojackson.formats.containers import npz_archive
from robojackson.formats.deploy.deployed_feedback import DeployedFeedback
from robojackson.formats.deploy.deployed_policy import DeployedPolicy
from robojackson.formats.deploy.licence_passport import (
    Ingredient,
    licence_texts,
    passport_json,
    passport_markdown,
)
from robojackson.formats.deploy.pack_readme import Figures, feedback_readme, policy_readme
from robojackson.formats.deploy.policy_graph import MOTION, policy_graph
from robojackson.formats.deploy.robot_xml import robot_xml
from robojackson.formats.deploy.settings_yaml import feedback_yaml, metadata, settings_yaml
from robojackson.robot.body_states import require_same_joints
from robojackson.robot.model import Robot
from robojackson.robot.sampling import sampled

RUNNER = Path(__file__).with_name("runner.py")
PARTS = {
    "run.py": Path(__file__).with_name("feedback_runner.py"),
    "network_runner.py": RUNNER,
    "state_estimator.py": Path(__file__).with_name("state_estimator.py"),
}
"""Modules of a pack without a network."""
MODULES = {
    "robojackson.formats.deploy.runner": "network_runner",
    "robojackson.formats.deploy.state_estimator": "state_estimator",
}
"""Names of their imports here and in a pack."""


def pack_files(
    policy: DeployedPolicy,
    robot: Robot,
    ingredients: list[Ingredient],
    evaluation: Figures | None = None,
) -> dict[str, bytes]:
    """Return the content of every file of a pack.

    Args:
        evaluation: Content of evaluation.json, with `passport` where one was made.

    Raises:
        BadConfiguration: the robot cannot be written as one file, or its root is not first.
        MissingDependency: the onnx package is not installed.
        UnknownName: the reference has other joints than the robot.
    """
    require_same_joints(policy.reference, robot.model)
    motion = motion_arrays(sampled(policy.reference), robot.model)
    names = motion["body_names"].tolist()
    if names[0] != policy.machine.root:
        raise BadConfiguration(
            f"root_body {policy.machine.root!r} is not the first body, {names[0]!r}"
        )
    columns = [names.index(name) for name in policy.bodies]
    held = {
        name: motion[name][:, columns] if name.startswith("body") else motion[name]
        for name in MOTION
    }
    about = metadata(policy)
    own = {
        "policy.onnx": policy_graph(policy, held, about, "mjlab"),
        "policy_obs.onnx": policy_graph(policy, held, about, "plain"),
        "motion.npz": npz_archive.pack(motion),
        "deploy.yaml": settings_yaml(policy),
        "run.py": RUNNER.read_bytes(),
        "README.md": policy_readme(policy, evaluation),
    }
    return own | _common(robot, ingredients, evaluation)


def feedback_files(
    feedback: DeployedFeedback,
    robot: Robot,
    ingredients: list[Ingredient],
    evaluation: Figures | None = None,
) -> dict[str, bytes]:
    """Return the content of every file of a pack without a network; arguments and errors of
    `pack_files`."""
    require_same_joints(feedback.machine.reference, robot.model)
    rows = feedback.archive()
    own = {
        **{name: _alone(path) for name, path in PARTS.items()},
        "feedback.npz": rows,
        "deploy.yaml": feedback_yaml(feedback, hashlib.sha256(rows).hexdigest()),
        "README.md": feedback_readme(feedback, evaluation),
    }
    return own | _common(robot, ingredients, evaluation)


def _alone(module: Path) -> bytes:
    """Return a module whose imports are from the pack."""
    text = module.read_text(encoding="utf-8")
    for here, there in MODULES.items():
        text = text.replace(here, there)
    return text.encode()


def _common(
    robot: Robot, ingredients: list[Ingredient], evaluation: Figures | None
) -> dict[str, bytes]:
    """Return the files of every pack."""
    files = {
        "robot.xml": robot_xml(robot),
        "LICENCES.md": passport_markdown(ingredients),
        "licences.json": passport_json(ingredients),
    } | licence_texts(robot.description)
    rows: Sequence[Figures] = (evaluation or {}).get("passport") or ()
    if rows:
        files["passport.json"] = json.dumps(list(rows), indent=1).encode()
    return files
