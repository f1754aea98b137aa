"""The mirror image of a robot: left and right exchanged.

A robot that is symmetric about its x-z plane can do the image of whatever it can do. Hinges change
places with their partners; the sign follows from the axes: a rotation's vector turns around in a
mirror but for its part along the mirror's normal. The image of a motion is driven by the image of
its feedback, which need not be searched again.
"""

from dataclasses import replace

import mujoco
import numpy as np
from jaxtyping import Float, Int

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.feedback.nominal_path import Gains
from robojackson.rl.feedback.standing_feet import foot_sites
from robojackson.rl.sim.motors import Motors
from robojackson.robot.model import Robot

ACROSS = np.array([1.0, -1.0, 1.0])
"""Of places; of rotation vectors it is the other way round."""
TURN = np.array([1.0, *-ACROSS])
"""Of quaternions."""


def hinge_partners(robot: Robot) -> tuple[Int[np.ndarray, " J"], Float[np.ndarray, " J"]]:
    """Return the hinge that takes each one's place, and the sign of its angle."""
    data = mujoco.MjData(robot.model)
    data.qpos[3] = 1.0
    mujoco.mj_kinematics(robot.model, data)
    axes = data.xaxis[1:]
    partner = partners(robot.joint_names)
    sign = np.sign(np.sum(axes * (axes[partner] * -ACROSS), 1))
    return partner, sign


def partners(names: tuple[str, ...]) -> Int[np.ndarray, " N"]:
    """Return the index of the name with left for right; its own where there is none."""
    swapped = [
        name.replace("left", "*").replace("right", "left").replace("*", "right") for name in names
    ]
    return np.array([names.index(new if new in names else old)
                     for old, new in zip(names, swapped, strict=True)])  # fmt: skip


class Images:
    """Images of a robot's states, motions and feedback. World frame, metres, radians."""

    def __init__(self, robot: Robot) -> None:
        self._hinge, self._sign = hinge_partners(robot)
        motors = Motors.of(robot.model).hinge
        self._motor = np.argsort(motors)[self._hinge[motors]]
        self._motor_sign = self._sign[motors]
        names = [robot.model.site(int(site)).name for site in foot_sites(robot)]
        self._foot = partners(tuple(names))
        root = np.concatenate([ACROSS, -ACROSS])
        self._state_sign = np.tile(np.concatenate([root, self._sign]), 2)
        half = np.concatenate([np.arange(6), 6 + self._hinge])
        self._state = np.concatenate([half, len(half) + half])

    def motion(self, motion: ReferenceMotion) -> ReferenceMotion:
        """Return the image of a motion."""
        bodies, points = partners(motion.body_names), partners(motion.keypoint_names)
        return replace(
            motion,
            cycle_offset=np.asarray(motion.cycle_offset) * ACROSS,
            qpos=self._qpos(motion.qpos),
            qvel=self._qvel(motion.qvel),
            body_pos_w=np.asarray(motion.body_pos_w)[:, bodies] * ACROSS,
            keypoints_w=np.asarray(motion.keypoints_w)[:, points] * ACROSS,
            contact=np.asarray(motion.contact)[:, partners(motion.contact_names)],
            torque_ratio=np.asarray(motion.torque_ratio)[:, self._motor],
        )

    def gains(self, gains: Gains) -> Gains:
        """Return the feedback along the image of a motion."""
        turned = gains.gain[:, self._motor][:, :, self._state]
        return replace(
            gains,
            gain=self._motor_sign[:, None] * turned * self._state_sign,
            offset=self._motor_sign * gains.offset[:, self._motor],
            qpos=self._qpos(gains.qpos),
            qvel=self._qvel(gains.qvel),
            places=gains.places[:, self._foot] * ACROSS,
        )

    def _qpos(self, qpos: Float[np.ndarray, "S nq"]) -> Float[np.ndarray, "S nq"]:
        parts = [
            qpos[:, :3] * ACROSS,
            qpos[:, 3:7] * TURN,
            self._sign * qpos[:, 7:][:, self._hinge],
        ]
        return np.concatenate(parts, 1)

    def _qvel(self, qvel: Float[np.ndarray, "S nv"]) -> Float[np.ndarray, "S nv"]:
        half = len(self._state) // 2
        image: np.ndarray = self._state_sign[:half] * qvel[:, self._state[:half]]
        return image
