"""Feed-forward: offsets of the targets that make a PD law produce the reference's torques.

A PD law produces a torque tau at a speed v only with its target at q + (tau + kd v) / kp. With soft
gains this offset is as large as a policy's range; `retarget.feasibility` computes the torque.
Radians, newton-metres; actuator order.
"""

import numpy as np
from jaxtyping import Float

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.retarget.feasibility.certification import motor_torques
from robojackson.retarget.feasibility.contact_wrench import Tolerance
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.sim.motors import Motors, feedforward_share, gains
from robojackson.rl.sim.reference_clip import require_usable
from robojackson.robot.model import Robot


def lead_of(
    robot: Robot, reference: ReferenceMotion, control: ControlConfig
) -> Float[np.ndarray, "S nu"] | None:
    """Return offsets of the motors' targets at every step of the reference; None without
    feed-forward.

    Raises:
        TrackTooShort, RejectedReference: no robot can follow it.
    """
    share = feedforward_share(robot, control)
    if not share:
        return None
    require_usable(reference)
    offset = np.asarray(reference.cycle_offset, float) if reference.cyclic else None
    qpos, motors = np.asarray(reference.qpos, float), Motors.of(robot.model)
    torques = motor_torques(robot, qpos, reference.dt, offset, Tolerance())
    torque = torques[:, motors.hinge] * motors.share
    kp, kd = gains(robot, control)
    speed = np.asarray(reference.qvel, float)[:, 6:][:, motors.hinge]
    result: np.ndarray = share * (torque + kd * speed) / kp
    return result
