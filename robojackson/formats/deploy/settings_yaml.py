"""`deploy.yaml`: the settings of a runner, one `key: JSON` a line, readable as YAML and as JSON by
line.

The first keys are those of Unitree's `deploy.yaml` (unitree_rl_mjlab, unitree_rl_lab), the others
are for the pack's own runner. Radians, seconds, newton-metres, in the order of `joint_names`.
"""

import json
from typing import Any

import numpy as np

from robojackson.formats.deploy.deployed_feedback import DeployedFeedback
from robojackson.formats.deploy.deployed_machine import DeployedMachine
from robojackson.formats.deploy.deployed_policy import DeployedPolicy

UNITREE_TERMS = ("motion_command", "motion_anchor_ori_b", "base_ang_vel", "joint_pos_rel",
                 "joint_vel_rel", "last_action")  # fmt: skip
"""Names of the observation's terms in Unitree's runner."""
Settings = dict[str, Any]
MOST_TILT = 1.0
"""Largest angle between robot and motion at which the runner must stop, rad."""
HEAD = """\
# Made by `robojackson export --to deploy`; do not edit: run.py compares it with the other files.
# Radians, seconds, newton-metres; arrays in the order of joint_names.
"""


def settings_yaml(policy: DeployedPolicy) -> bytes:
    """Return the content of the file for a network."""
    return _text(_of_network(policy))


def polished_yaml(policy: DeployedPolicy, feedback: DeployedFeedback, sha256: str) -> bytes:
    """Return the content of the file for a network on top of feedback; arguments of the two."""
    network = _of_network(policy)
    most = feedback.limit + policy.action_scale
    network["limits"] |= _reach(policy.machine, feedback.targets, most)
    return _text(network | _of_feedback(feedback, sha256))


def _of_network(policy: DeployedPolicy) -> Settings:
    machine = _of_machine(policy.machine)
    targets = np.asarray(policy.reference.qpos, float)[:, 7:] + policy.lead
    machine["limits"] |= _reach(policy.machine, targets, policy.action_scale)
    scale = _numbers(policy.action_scale)
    action = {
        "clip": None,
        "joint_names": [".*"],
        "scale": scale,
        "offset": machine["default_joint_pos"],
        "joint_ids": None,
    }
    unitree = {
        "commands": {},
        "actions": {"JointPositionAction": action},
        "observations": _observations(policy),
    }
    ours = {
        "anchor_body_name": policy.anchor,
        "action_scale": scale,
        "command_leads_rows": 1,
        "observation_terms": _offsets(policy),
        "layout": [policy.layout_sha256, policy.observation_size],
    }
    return machine | unitree | ours


def feedback_yaml(feedback: DeployedFeedback, sha256: str) -> bytes:
    """Return the content of the file for feedback without a network.

    Args:
        sha256: Digest of feedback.npz.
    """
    machine = _of_machine(feedback.machine)
    machine["limits"] |= _reach(feedback.machine, feedback.targets, feedback.limit)
    return _text(machine | _of_feedback(feedback, sha256))


def _of_feedback(feedback: DeployedFeedback, sha256: str) -> Settings:
    return {
        "cycle_offset": _numbers(feedback.machine.reference.cycle_offset),
        "imu": list(feedback.imu),
        "soles": [ball.as_row() for ball in feedback.soles],
        "feet": [ball.as_row() for ball in feedback.feet],
        "feedback_limit": _numbers(feedback.limit),
        "odometry": feedback.odometry,
        "feedback": sha256,
    }


def _reach(
    machine: DeployedMachine, targets: np.ndarray, most: np.ndarray
) -> dict[str, list[float]]:
    """Return the limits of the targets: the joints' ranges, and beyond them what the driver of the
    robot may ask for. A target beyond a joint's end is a torque there, whose limit holds; without
    it a robot with bent knees or ankles cannot be caught, and gets less than the feed-forward.

    Args:
        targets: The motion's own, with their lead, rad (S, J).
        most: Largest move of a target by feedback and network, rad (J).
    """
    own, lowest, highest = limits(machine), targets.min(0) - most, targets.max(0) + most
    return {
        "lower": _numbers(np.minimum(own["lower"], lowest)),
        "upper": _numbers(np.maximum(own["upper"], highest)),
    }


def _text(settings: Settings) -> bytes:
    lines = [f"{key}: {json.dumps(value)}" for key, value in settings.items()]
    return (HEAD + "\n".join(lines) + "\n").encode()


def _of_machine(machine: DeployedMachine) -> Settings:
    """Return the settings of robot and motion, those of Unitree's runner first."""
    reference = machine.reference
    return {
        "joint_ids_map": list(machine.places),
        "step_dt": reference.dt,
        "stiffness": _numbers(machine.stiffness),
        "damping": _numbers(machine.damping),
        "default_joint_pos": _numbers(machine.default),
        "robot": reference.robot,
        "joint_names": list(machine.joints),
        "root_body_name": machine.root,
        "limits": limits(machine),
        "stop_tilt": float(max(machine.fall_tilt, MOST_TILT)),
        "cyclic": reference.cyclic,
        "rows": len(reference),
    }


def limits(machine: DeployedMachine) -> dict[str, list[float]]:
    """Return the ranges of the joints, rad, and the limits of torques and of speeds."""
    low, high = machine.model.jnt_range[1:].T
    free = machine.model.jnt_limited[1:] == 0
    return {
        "lower": _numbers(np.where(free, -1e3, low)),
        "upper": _numbers(np.where(free, 1e3, high)),
        "torque": _numbers(machine.torque_limit),
        "speed": _numbers(machine.speed_limit),
    }


def metadata(policy: DeployedPolicy) -> dict[str, str]:
    """Return the metadata of the ONNX files: the keys of mjlab's exporter, and the layout."""
    names = [name for name, _ in policy.terms]
    lists = {
        "joint_names": policy.joints,
        "joint_stiffness": policy.machine.stiffness,
        "joint_damping": policy.machine.damping,
        "default_joint_pos": policy.default,
        "command_names": ("motion",),
        "observation_names": names,
        "observation_terms_scale": [1.0] * len(names),
        "observation_terms_flatten_history_dim": [True] * len(names),
        "observation_terms_history_length": [0] * len(names),
        "observation_terms_clip": ["-inf;inf"] * len(names),
        "action_scale": policy.action_scale,
        "body_names": policy.bodies,
    }
    return {key: ",".join(map(_word, values)) for key, values in lists.items()} | {
        "run_path": "robojackson",
        "anchor_body_name": policy.anchor,
        "observation_layout": json.dumps(_offsets(policy)),
        "observation_layout_sha256": policy.layout_sha256,
        "step_dt": repr(policy.reference.dt),
        "facts": json.dumps(policy.facts, sort_keys=True),
    }


def _observations(policy: DeployedPolicy) -> Settings:
    """Return the terms as Unitree's runner reads them; their order is that of the observation."""
    found: Settings = {}
    for name, (_, size) in zip(UNITREE_TERMS, policy.terms, strict=True):
        params = {"command_name": "motion"} if name.startswith("motion") else {}
        found[name] = {
            "params": params,
            "clip": None,
            "scale": [1.0] * size,
            "history_length": 1,
        }
    return found


def _offsets(policy: DeployedPolicy) -> list[Settings]:
    """Return names, sizes and offsets of the terms."""
    found, at = [], 0
    for name, size in policy.terms:
        found.append({"name": name, "size": size, "offset": at})
        at += size
    return found


def _numbers(values: np.ndarray) -> list[float]:
    return [float(value) for value in values]


def _word(value: Any) -> str:
    return f"{value:.9g}" if isinstance(value, float) else str(value)
