"""Contents of a deploy pack of a network: its layers, and the layout of its observation.

All arrays are in the order of the robot's hinges, which is that of qpos. Radians.
"""

import hashlib
import json
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.formats.deploy.deployed_machine import DeployedMachine
from robojackson.motion.reference_motion import ReferenceMotion

Layers = tuple[tuple[np.ndarray, np.ndarray], ...]
TERMS = ("command", "motion_anchor_ori_b", "base_ang_vel", "joint_pos", "joint_vel", "actions")
"""Terms of mjlab's tracking observation without state estimation, in its order."""


@dataclass(frozen=True)
class Link:
    """A fixed turn or a hinge between the root body and the anchor body.

    Attributes:
        turn: Fixed rotation before the hinge.
        hinge: Index of the hinge; None where it has none.
        axis: Axis of the hinge, in its body.
        zero: Angle at the zero position of the hinge, rad.
    """

    turn: Float[np.ndarray, "3 3"]
    hinge: int | None = None
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    zero: float = 0.0


@dataclass(frozen=True)
class DeployedPolicy:
    """A policy that uses only measurements of the robot itself, and the settings to run it.

    Attributes:
        machine: Robot and motion.
        layers: (weight (in, out), bias (out,)); ReLU between them, tanh at the end. Inputs are in
            the order of `TERMS`, times `input_scale` and clipped to +-`input_clip`; outputs are
            residuals, -1..1.
        lead: Offset of the targets from the reference's angles at every step, rad.
        anchor: Name of the body whose attitude is observed.
        chain: Links from the root to the anchor.
        bodies: Names of the bodies whose poses the policy file holds.
        action_scale: Radians per unit of the action; a residual of 1 is equally large.
        facts: Metadata of the training.
    """

    machine: DeployedMachine
    layers: Layers
    input_scale: Float[np.ndarray, " D"]
    input_clip: float
    lead: Float[np.ndarray, "S J"]
    anchor: str
    chain: tuple[Link, ...]
    bodies: tuple[str, ...]
    action_scale: Float[np.ndarray, " J"]
    facts: dict[str, Any]

    @property
    def reference(self) -> ReferenceMotion:
        """Return the motion."""
        return self.machine.reference

    @property
    def default(self) -> Float[np.ndarray, " J"]:
        """Return the angles that the observation and the action are relative to, rad."""
        return self.machine.default

    @property
    def joints(self) -> tuple[str, ...]:
        """Return the names of the hinges."""
        return self.machine.joints

    @property
    def terms(self) -> list[tuple[str, int]]:
        """Return names and sizes of the terms of the observation."""
        count = len(self.joints)
        return list(zip(TERMS, (2 * count, 6, 3, count, count, count), strict=True))

    @property
    def observation_size(self) -> int:
        """Return the length of the observation."""
        return sum(size for _, size in self.terms)

    @property
    def layout_sha256(self) -> str:
        """Return the digest of terms, joints and anchor, as the runner computes it."""
        text = json.dumps([self.terms, list(self.joints), self.anchor])
        return hashlib.sha256(text.encode()).hexdigest()


def chain_between(model: mujoco.MjModel, root: str, anchor: str) -> tuple[Link, ...]:
    """Return the turns from one body to another that hangs from it."""
    body, end, links = int(model.body(anchor).id), int(model.body(root).id), []
    while body != end and body != 0:
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.body_quat[body])
        first = int(model.body_jntadr[body])
        for joint in reversed(range(first, first + int(model.body_jntnum[body]))):
            x, y, z = (float(value) for value in model.jnt_axis[joint])
            place = int(model.jnt_qposadr[joint])
            links.append(Link(np.eye(3), place - 7, (x, y, z), float(model.qpos0[place])))
        links.append(Link(turn.reshape(3, 3)))
        body = int(model.body_parentid[body])
    return tuple(reversed(links))
