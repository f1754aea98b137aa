"""Mirror images of a robot's reference motions and observations: left and right exchanged.

A robot that is symmetric about its x-z plane can do the image of whatever it can do. Hinges change
places with their partners; the sign follows from the axes: a rotation's vector turns around in a
mirror but for its part along the mirror's normal.
"""

from dataclasses import dataclass, replace

import mujoco
import numpy as np
from jaxtyping import Float, Int

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.sim.motors import Motors
from robojackson.rl.sim.preview import AHEAD_S
from robojackson.robot.model import Robot

ACROSS = np.array([1.0, -1.0, 1.0])
"""Of places; of rotation vectors it is the other way round."""


def mirrored(reference: ReferenceMotion, robot: Robot) -> ReferenceMotion:
    """Return the motion in a mirror across the world's x-z plane."""
    partner, sign = hinge_partners(robot)
    qpos, qvel = np.array(reference.qpos, float), np.array(reference.qvel, float)
    for values, offset in ((qpos, 7), (qvel, 6)):
        values[:, offset:] = values[:, offset:][:, partner] * sign
        values[:, :3] *= ACROSS
    qpos[:, 3:7] *= [1.0, -1.0, 1.0, -1.0]
    qvel[:, 3:6] *= -ACROSS
    bodies = _partners(robot.body_names)
    return replace(
        reference,
        qpos=qpos,
        qvel=qvel,
        cycle_offset=reference.cycle_offset * ACROSS,
        body_pos_w=reference.body_pos_w[:, bodies] * ACROSS,
        keypoints_w=reference.keypoints_w[:, _partners(robot.keypoint_names)] * ACROSS,
        contact=reference.contact[:, _partners(robot.contact_names)],
        torque_ratio=reference.torque_ratio[:, partner],
    )


def hinge_partners(robot: Robot) -> tuple[Int[np.ndarray, " J"], Float[np.ndarray, " J"]]:
    """Return the hinge that takes each one's place, and the sign of its angle."""
    data = mujoco.MjData(robot.model)
    data.qpos[3] = 1.0
    mujoco.mj_kinematics(robot.model, data)
    axes = data.xaxis[1:]
    partner = _partners(robot.joint_names)
    sign = np.sign(np.sum(axes * (axes[partner] * -ACROSS), 1))
    return partner, sign


@dataclass(frozen=True)
class ObservationMirror:
    """Mirror images of a dancer's observations and actions, as signed permutations.

    Attributes:
        source, sign: Number that takes each one's place in an observation, and its sign.
        action_source, action_sign: The same of an action.
    """

    source: Int[np.ndarray, " D"]
    sign: Float[np.ndarray, " D"]
    action_source: Int[np.ndarray, " nu"]
    action_sign: Float[np.ndarray, " nu"]

    @staticmethod
    def of(robot: Robot) -> "ObservationMirror":
        """Return the mirror of a robot's observation `preview` (`rl.modes.observation`)."""
        partner, sign = hinge_partners(robot)
        driven = Motors.of(robot.model).hinge
        actions = np.array([int(np.flatnonzero(driven == partner[hinge])[0]) for hinge in driven])
        hinges, motors = (partner, sign), (actions, sign[driven])
        parts = [_plain(-ACROSS), _plain(ACROSS), _plain(-ACROSS)]  # gyro, columns of the turn
        parts += [hinges, hinges, hinges, hinges, motors]
        root = _plain(np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0, *ACROSS]))
        parts += [root, hinges] * len(AHEAD_S)
        starts = np.cumsum([0, *(len(part) for part, _ in parts)])
        source = np.concatenate([
            first + part for first, (part, _) in zip(starts[:-1], parts, strict=True)
        ])  # fmt: skip
        return ObservationMirror(source, np.concatenate([s for _, s in parts]), *motors)

    def observation(self, seen: Float[np.ndarray, "N D"]) -> Float[np.ndarray, "N D"]:
        """Return the observations in the mirror."""
        result: np.ndarray = seen[:, self.source] * self.sign.astype(seen.dtype)
        return result

    def action(self, action: Float[np.ndarray, "N nu"]) -> Float[np.ndarray, "N nu"]:
        """Return the actions in the mirror."""
        result: np.ndarray = action[:, self.action_source] * self.action_sign.astype(action.dtype)
        return result


def _plain(sign: Float[np.ndarray, " K"]) -> tuple[Int[np.ndarray, " K"], Float[np.ndarray, " K"]]:
    return np.arange(len(sign)), sign


def _partners(names: tuple[str, ...]) -> Int[np.ndarray, " N"]:
    """Return the index of the name with left for right; its own where there is none."""
    swapped = [
        name.replace("left", "*").replace("right", "left").replace("*", "right") for name in names
    ]
    return np.array([names.index(new if new in names else old)
                     for old, new in zip(names, swapped, strict=True)])  # fmt: skip
