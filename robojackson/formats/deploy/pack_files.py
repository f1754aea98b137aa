"""The files of a deploy pack by name."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from robojackson.errors import BadConfiguration
from robojackson.formats.beyondmimic import motion_arrays
from robojackson.formats.containers import npz_archive
from robojackson.formats.deploy.deployed_policy import DeployedPolicy
from robojackson.formats.deploy.licence_passport import (
    Ingredient,
    licence_texts,
    passport_json,
    passport_markdown,
)
from robojackson.formats.deploy.pack_readme import pack_readme
from robojackson.formats.deploy.policy_graph import MOTION, policy_graph
from robojackson.formats.deploy.robot_xml import robot_xml
from robojackson.formats.deploy.settings_yaml import metadata, settings_yaml
from robojackson.robot.body_states import require_same_joints
from robojackson.robot.model import Robot
from robojackson.robot.sampling import sampled

RUNNER = Path(__file__).with_name("runner.py")


def pack_files(
    policy: DeployedPolicy,
    robot: Robot,
    ingredients: list[Ingredient],
    evaluation: Mapping[str, Any] | None = None,
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
    if names[0] != policy.root:
        raise BadConfiguration(f"root_body {policy.root!r} is not the first body, {names[0]!r}")
    columns = [names.index(name) for name in policy.bodies]
    held = {
        name: motion[name][:, columns] if name.startswith("body") else motion[name]
        for name in MOTION
    }
    about = metadata(policy)
    rows: Sequence[Mapping[str, Any]] = (evaluation or {}).get("passport") or ()
    files = {
        "policy.onnx": policy_graph(policy, held, about, "mjlab"),
        "policy_obs.onnx": policy_graph(policy, held, about, "plain"),
        "motion.npz": npz_archive.pack(motion),
        "deploy.yaml": settings_yaml(policy),
        "robot.xml": robot_xml(robot),
        "run.py": RUNNER.read_bytes(),
        "README.md": pack_readme(policy, evaluation, rows),
        "LICENCES.md": passport_markdown(ingredients),
        "licences.json": passport_json(ingredients),
    } | licence_texts(robot.description)
    if rows:
        files["passport.json"] = json.dumps(list(rows), indent=1).encode()
    return files
