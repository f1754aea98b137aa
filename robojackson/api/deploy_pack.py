"""Write a deploy pack: a folder that runs a trained policy without RoboJackson."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np

from robojackson.api.arguments import FilePath, RobotLike, require_robot, robot_of
from robojackson.api.feedback_pack import deployed_feedback
from robojackson.api.pack_parts import (
    REFERENCE,
    beside,
    machine_of,
    motor_of_hinge,
    own_evaluation,
    write_pack,
)
from robojackson.api.policy_ingredients import policy_ingredients
from robojackson.api.robots import load_robot
from robojackson.errors import BadPolicy
from robojackson.formats.deploy.deployed_policy import (
    DeployedPolicy,
    chain_between,
)
from robojackson.formats.deploy.licence_passport import with_declared
from robojackson.formats.deploy.pack_files import pack_files
from robojackson.formats.deploy.pack_readme import Figures
from robojackson.motion.reference_motion import ReferenceMotion, poses_sha256
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.evaluation.controllers import control_of
from robojackson.rl.feedback.nominal_path import Progress, no_progress
from robojackson.rl.modes.observation import CLIP, HINGE_SPEED_SCALE, SPEED_SCALE
from robojackson.rl.policy import Policy, load_policy
from robojackson.rl.policy_facts import mode_of, networks_sha256, observation_of, recorded_law
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.motors import residual_scale
from robojackson.robot.model import Robot

LAST_ACTION_SCALE = 0.5
"""As in the observation of mode `track`."""


def write_deploy_pack(
    policy: FilePath,
    folder: FilePath,
    *,
    reference: FilePath | None = None,
    robot: RobotLike | None = None,
    evaluation: FilePath | None = None,
    licences: Mapping[str, str] | None = None,
    progress: Progress = no_progress,
) -> Figures:
    """Write a policy that sees what a robot measures by itself, as a pack that runs alone.

    Args:
        policy: policy.safetensors of a training with `track.observation=onboard`.
        folder: Folder for the pack.
        reference: The motion that it was trained on; None looks beside the policy.
        robot: The one that the motion was made for; None finds it.
        evaluation: evaluation.json of `robojackson evaluate`, whose figures and passport go into
            the pack; None looks beside the policy.
        licences: Licences of inputs by kind, where nothing records them: `{"clip": "CC-BY-4.0"}`.
        progress: Called with a name, the steps that are done, and all, while the feedback that the
            policy was trained on top of is computed.

    Returns:
        What was written: files, inputs, layout, the passport's cases and its weakest, and what the
        licences allow.

    Raises:
        BadPolicy: a policy of another mode, observation, law, robot or motion.
        StoreError: a file is missing or cannot be written.
        BadConfiguration: a robot or a licence that cannot go into a pack.
        MissingDependency: the onnx package is not installed.
    """
    path = Path(policy)
    found = load_policy(path)
    _require_onboard(found)
    source = beside(path, reference, REFERENCE, "--reference")
    motion = ReferenceMotion.load(source)
    _require_same_motion(found, motion, source)
    machine = robot_of(motion) if robot is None else require_robot(motion, load_robot(robot))
    parts = deployed_policy(found, motion, machine)
    ingredients = with_declared(policy_ingredients(found, path, source, machine), licences or {})
    evaluated = _evaluation_of(found, path, motion, evaluation)
    feedback, control = None, control_of(found, machine)
    if control.feedback:
        feedback = deployed_feedback(control, motion, machine, progress, found)
    files = pack_files(parts, machine, ingredients, evaluated, feedback)
    written = write_pack(Path(folder), files, ingredients, evaluated)
    layout = {"observations": parts.observation_size, "layout_sha256": parts.layout_sha256}
    return {"robot": motion.robot, **layout, **written}


def _evaluation_of(
    policy: Policy, path: Path, motion: ReferenceMotion, given: FilePath | None
) -> Figures | None:
    """Return the evaluation of these networks on this motion (`own_evaluation`)."""
    own = networks_sha256(policy)

    def fits(found: Figures) -> bool:
        return "tracker" not in found and found.get("networks_sha256", own) == own

    command = f"robojackson evaluate {path} REFERENCE"
    return own_evaluation(f"{path} as it is now", command, path.parent, given, motion, fits)


def deployed_policy(policy: Policy, reference: ReferenceMotion, robot: Robot) -> DeployedPolicy:
    """Put together what a pack is made from, in the order of the hinges.

    Raises:
        BadPolicy: it was trained for another robot, or the robot has hinges without a motor.
    """
    control, motor = control_of(policy, robot), motor_of_hinge(robot)
    lead = lead_of(robot, reference, control)
    names, count = robot.keypoint_names, len(robot.joint_names)
    body_of = robot.model.site_bodyid[robot.keypoint_sites]
    anchor = robot.model.body(body_of[names.index("head")]).name
    bodies = sorted({*body_of.tolist(), robot.model.body(robot.description.root_body).id})
    layers, scale = _network(policy, motor)
    return DeployedPolicy(
        layers=layers,
        input_scale=scale,
        input_clip=CLIP,
        machine=machine_of(robot, reference, control),
        lead=np.zeros((len(reference), count)) if lead is None else lead[:, motor],
        anchor=anchor,
        chain=chain_between(robot.model, robot.description.root_body, anchor),
        bodies=tuple(robot.model.body(index).name for index in bodies),
        action_scale=residual_scale(robot, control)[motor],
        facts=dict(policy.facts),
    )


def _network(
    policy: Policy, motor: np.ndarray
) -> tuple[tuple[tuple[np.ndarray, np.ndarray], ...], np.ndarray]:
    """Return the layers with inputs in the order of the pack's terms and hinges, and the inputs'
    scales.

    The policy sees gyroscope, attitude, angles, speeds, target angles, target speeds, last action
    (`Observer`); the pack has targets, attitude, gyroscope, angles, speeds, last action.
    """
    count = len(motor)
    ends = np.cumsum([0, 3, 6, count, count, count, count, count])
    gyro, turn, angle, speed, aim, aim_speed, last = (
        np.arange(start, end) for start, end in pairwise(ends)
    )
    order = np.concatenate([aim, aim_speed, turn, gyro, angle, speed, last[motor]])
    joints = [(1.0, count), (HINGE_SPEED_SCALE, count)]
    parts = [*joints, (1.0, 6), (SPEED_SCALE, 3), *joints, (LAST_ACTION_SCALE, count)]
    scale = np.concatenate([np.full(size, factor) for factor, size in parts])
    layers = [(weight.copy(), bias.copy()) for weight, bias in policy.layers]
    layers[0] = layers[0][0][order], layers[0][1]
    weight, bias = layers[-1]
    layers[-1] = weight[:, motor], bias[motor]
    return tuple(layers), scale


def _require_onboard(policy: Policy) -> None:
    """Refuse what a real robot cannot run.

    Raises:
        BadPolicy: another mode, observation or law, or feedback from the exact root.
    """
    law = recorded_law(policy)
    kind = law.get("law", ControlConfig().law)
    if mode_of(policy) == "track" and observation_of(policy) != "onboard":
        raise BadPolicy(
            f"the policy takes {policy.observation_size} inputs of the full observation, which no "
            "real robot measures (place, velocity): train with --set track.observation=onboard"
        )
    if mode_of(policy) != "track" or kind != "pd":
        raise BadPolicy(
            f"a policy of mode {mode_of(policy)} and law {kind}: a deploy pack needs mode track, "
            "law pd and --set track.observation=onboard"
        )
    if law.get("feedback") and law.get("root_state") != "estimated":
        raise BadPolicy(
            "the policy was trained on the feedback along the reference from the exact place and "
            "velocity, which no real robot measures: train with --set "
            "track.control.root_state=estimated"
        )


def _require_same_motion(policy: Policy, motion: ReferenceMotion, source: Path) -> None:
    learnt = policy.facts.get("reference_sha256")
    if learnt != poses_sha256(motion):
        raise BadPolicy(
            f"{source} is not the motion that the policy was trained on (sha256 "
            f"{str(learnt)[:12]}, here {poses_sha256(motion)[:12]}): give it with --reference"
        )
