"""The files of a deploy pack by name."""

import hashlib
import json
from collections.abc import Mapping, Sequence
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
from robojackson.formats.deploy.pack_readme import (
    Figures,
    feedback_readme,
    policy_readme,
    polished_readme,
)
from robojackson.formats.deploy.policy_graph import MOTION, policy_graph
from robojackson.formats.deploy.robot_xml import robot_xml
from robojackson.formats.deploy.settings_yaml import (
    feedback_yaml,
    metadata,
    polished_yaml,
    settings_yaml,
)
from robojackson.robot.body_states import require_same_joints
from robojackson.robot.model import Robot
from robojackson.robot.sampling import sampled

OF_NETWORK = {"run.py": "runner", "simulated_robot.py": "simulated_robot"}
OF_FEEDBACK = {
    "run.py": "feedback_runner",
    "network_runner.py": "runner",
    "simulated_robot.py": "simulated_robot",
    "state_estimator.py": "state_estimator",
}
OF_BOTH = OF_FEEDBACK | {"run.py": "polished_runner", "feedback_runner.py": "feedback_runner"}
"""Modules of the kinds of packs by the names of their files."""
OF_SOME = {
    *(*OF_BOTH, *OF_NETWORK, "policy.onnx", "policy_obs.onnx", "motion.npz", "feedback.npz"),
    "passport.json",
}
"""Files that a pack may have and another not."""


def pack_files(
    policy: DeployedPolicy,
    robot: Robot,
    ingredients: list[Ingredient],
    evaluation: Figures | None = None,
    feedback: DeployedFeedback | None = None,
) -> dict[str, bytes]:
    """Return the content of every file of a pack with a network.

    Args:
        feedback: What the policy was trained on top of; only the pack's own runner knows it.
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
    rows = b"" if feedback is None else feedback.archive()
    digest = hashlib.sha256(rows).hexdigest()
    if feedback is not None:
        about["needs_feedback_sha256"] = digest
    network = {
        "policy.onnx": policy_graph(policy, held, about, "mjlab"),
        "motion.npz": npz_archive.pack(motion),
    }
    if feedback is None:
        own = {
            "policy_obs.onnx": policy_graph(policy, held, about, "plain"),
            "deploy.yaml": settings_yaml(policy),
            "README.md": policy_readme(policy, evaluation),
            **_modules(OF_NETWORK),
        }
    else:
        own = {
            "feedback.npz": rows,
            "deploy.yaml": polished_yaml(policy, feedback, digest),
            "README.md": polished_readme(policy, evaluation),
            **_modules(OF_BOTH),
        }
    return network | own | _common(robot, ingredients, evaluation)


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
        **_modules(OF_FEEDBACK),
        "feedback.npz": rows,
        "deploy.yaml": feedback_yaml(feedback, hashlib.sha256(rows).hexdigest()),
        "README.md": feedback_readme(feedback, evaluation),
    }
    return own | _common(robot, ingredients, evaluation)


def _modules(names: Mapping[str, str]) -> dict[str, bytes]:
    """Return modules whose imports are from the pack, by the names of their files."""
    found = {}
    for file, module in names.items():
        text = Path(__file__).with_name(f"{module}.py").read_text(encoding="utf-8")
        for other, imported in names.items():
            here = f"from {__package__}.{imported} import"
            text = text.replace(here, f"from {other.removesuffix('.py')} import")
        if file != "run.py":  # a part alone would let the robot fall
            text = text.partition('\n\nif __name__ == "__main__":')[0]
        found[file] = text.encode()
    return found


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
