"""`deploy.yaml`: the settings of a runner, one `key: JSON` a line, readable as YAML and as JSON by
line.

The first keys are those of Unitree's `deploy.yaml` (unitree_rl_mjlab, unitree_rl_lab), the others
are for the pack's own runner. Radians, seconds, newton-metres, in the order of `joint_names`.
"""

import json
from typing import Any

import numpy as np

from robojackson.formats.deploy.deployed_policy import DeployedPolicy

UNITREE_TERMS = ("motion_command", "motion_anchor_ori_b", "base_ang_vel", "joint_pos_rel",
                 "joint_vel_rel", "last_action")  # fmt: skip
"""Names of the observation's terms in Unitree's runner."""
MOST_TILT = 1.0
"""Largest angle between robot and motion at which the runner must stop, rad."""
HEAD = """\
# Made by `robojackson export --to deploy`; do not edit: run.py compares it with policy.onnx.
# Radians, seconds, newton-metres; arrays in the order of joint_names.
"""


def settings_yaml(policy: DeployedPolicy) -> bytes:
    """Return the content of the file."""
    lines = [f"{key}: {json.dumps(value)}" for key, value in _settings(policy).items()]
    return (HEAD + "\n".join(lines) + "\n").encode()


def _settings(policy: DeployedPolicy) -> dict[str, Any]:
    reference = policy.reference
    default = _numbers(policy.default)
    action = {
        "clip": None,
        "joint_names": [".*"],
        "scale": _numbers(policy.action_scale),
        "offset": default,
        "joint_ids": None,
    }
    return {
        "joint_ids_map": list(policy.places),
        "step_dt": reference.dt,
        "stiffness": _numbers(policy.stiffness),
        "damping": _numbers(policy.damping),
        "default_joint_pos": default,
        "commands": {},
        "actions": {"JointPositionAction": action},
        "observations": _observations(policy),
        "robot": reference.robot,
        "joint_names": list(policy.joints),
        "root_body_name": policy.root,
        "anchor_body_name": policy.anchor,
        "action_scale": _numbers(policy.action_scale),
        "limits": limits(policy),
        "stop_tilt": float(max(policy.fall_tilt, MOST_TILT)),
        "cyclic": reference.cyclic,
        "rows": len(reference),
        "command_leads_rows": 1,
        "observation_terms": _offsets(policy),
        "layout": [policy.layout_sha256, policy.observation_size],
    }


def limits(policy: DeployedPolicy) -> dict[str, list[float]]:
    """Return the limits of the targets, rad, of torques and of speeds."""
    low, high = policy.model.jnt_range[1:].T
    free = policy.model.jnt_limited[1:] == 0
    return {
        "lower": _numbers(np.where(free, -1e3, low)),
        "upper": _numbers(np.where(free, 1e3, high)),
        "torque": _numbers(policy.torque_limit),
        "speed": _numbers(policy.speed_limit),
    }


def metadata(policy: DeployedPolicy) -> dict[str, str]:
    """Return the metadata of the ONNX files: the keys of mjlab's exporter, and the layout."""
    names = [name for name, _ in policy.terms]
    lists = {
        "joint_names": policy.joints,
        "joint_stiffness": policy.stiffness,
        "joint_damping": policy.damping,
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


def _observations(policy: DeployedPolicy) -> dict[str, Any]:
    """Return the terms as Unitree's runner reads them; their order is that of the observation."""
    found: dict[str, Any] = {}
    for name, (_, size) in zip(UNITREE_TERMS, policy.terms, strict=True):
        params = {"command_name": "motion"} if name.startswith("motion") else {}
        found[name] = {
            "params": params,
            "clip": None,
            "scale": [1.0] * size,
            "history_length": 1,
        }
    return found


def _offsets(policy: DeployedPolicy) -> list[dict[str, Any]]:
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
