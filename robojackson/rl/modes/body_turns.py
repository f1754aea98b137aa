"""Orientations of a robot's bodies from its hinge angles, for many robots at once."""

from dataclasses import dataclass
from functools import cache

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.geometry.rotations import quat_angle, quat_multiply


@dataclass(frozen=True)
class _Chain:
    """Bodies of a robot that hinges move, parents first.

    Attributes:
        parent: Row of the body that each hangs on; -1 for the root.
        fixed: Rotation of each in that body at zero angles, wxyz.
        hinges: Hinges of each, in order.
        axis: Axis of each hinge in its body.
        zero: Angle of each hinge in the zero pose, rad.
    """

    parent: tuple[int, ...]
    fixed: Float[np.ndarray, "B 4"]
    hinges: tuple[tuple[int, ...], ...]
    axis: Float[np.ndarray, "J 3"]
    zero: Float[np.ndarray, " J"]


def turn_error(
    model: mujoco.MjModel, qpos: Float[np.ndarray, "N nq"], aim: Float[np.ndarray, "N nq"]
) -> Float[np.ndarray, " N"]:
    """Return the root mean square, over the bodies that hinges move, of the angle between the
    orientations of two poses in the world, rad (whole_body_tracking's `body_ori`, Liao et al.,
    2025, without its turn of the reference about the vertical)."""
    angle = quat_angle(body_turns(model, qpos), body_turns(model, aim))
    return np.asarray(np.sqrt(np.add.reduce(angle**2, -1) / angle.shape[-1]))


def body_turns(
    model: mujoco.MjModel, qpos: Float[np.ndarray, "N nq"]
) -> Float[np.ndarray, "N B 4"]:
    """Return the orientations of the bodies that hinges move, wxyz in the world."""
    chain = _chain(model)
    half = (qpos[:, 7:] - chain.zero) / 2
    by_hinge = np.concatenate(
        [np.cos(half)[..., None], np.sin(half)[..., None] * chain.axis], axis=-1
    )
    turns = np.empty((len(qpos), len(chain.parent), 4))
    for body, (parent, hinges) in enumerate(zip(chain.parent, chain.hinges, strict=True)):
        above = qpos[:, 3:7] if parent < 0 else turns[:, parent]
        turn = quat_multiply(above, np.broadcast_to(chain.fixed[body], above.shape))
        for hinge in hinges:
            turn = quat_multiply(turn, by_hinge[:, hinge])
        turns[:, body] = turn
    return turns


@cache
def _chain(model: mujoco.MjModel) -> _Chain:
    """Read the chain of bodies; those without a hinge turn with the one that they hang on."""
    hinges: dict[int, list[int]] = {}
    for joint in range(1, model.njnt):
        hinges.setdefault(int(model.jnt_bodyid[joint]), []).append(joint - 1)
    root, row = int(model.jnt_bodyid[0]), {body: n for n, body in enumerate(hinges)}
    parents, fixed = [], []
    for body in row:
        turn, above = np.array(model.body_quat[body]), int(model.body_parentid[body])
        while above != root and above not in row:
            turn = quat_multiply(np.array(model.body_quat[above]), turn)
            above = int(model.body_parentid[above])
        parents.append(row.get(above, -1))
        fixed.append(turn)
    return _Chain(
        tuple(parents), np.array(fixed), tuple(map(tuple, hinges.values())),
        np.array(model.jnt_axis[1:]), np.array(model.qpos0[7:]),
    )  # fmt: skip
