"""Motors of a robot: the hinge of each, its torque limit, and the range of a policy's action.

Radians, newton-metres; actuator order.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, Int

from robojackson.rl.config.train_config import ControlConfig
from robojackson.robot.actuation import joint_torque, motor_torque
from robojackson.robot.description import FeedbackPath, RobotDescription
from robojackson.robot.model import Robot


@dataclass(frozen=True)
class Motors:
    """Actuators of the robot: the hinge of each, and its torque.

    Attributes:
        hinge: Index of the driven hinge among `qpos[7:]`, one an actuator.
        gear: Torque per unit of control, N m: gear and gain of the actuator.
        limit: Largest torque, N m: that, in size, x the control range, within the force ranges of
            actuator and joint.
    """

    hinge: Int[np.ndarray, " nu"]
    gear: Float[np.ndarray, " nu"]
    limit: Float[np.ndarray, " nu"]

    @staticmethod
    def of(model: mujoco.MjModel) -> "Motors":
        """Return the motors of a model whose first joint is free and whose others are hinges."""
        gear = model.actuator_gear[:, 0] * model.actuator_gainprm[:, 0]
        return Motors(
            hinge=model.jnt_qposadr[model.actuator_trnid[:, 0]] - 7,
            gear=gear,
            limit=np.array([_largest(model, index) for index in range(model.nu)]),
        )

    @property
    def share(self) -> Float[np.ndarray, " nu"]:
        """Share of each motor in the gains and the torque of its hinge: 1 alone; several share in
        proportion to their torque limits, evenly where these are zero or infinite."""
        together = self.hinge[:, None] == self.hinge
        total = np.where(together, self.limit, 0.0).sum(1)
        result: np.ndarray = 1.0 / together.sum(1)
        by_limit = (result < 1) & (total > 0) & np.isfinite(total)
        result[by_limit] = self.limit[by_limit] / total[by_limit]
        return result


def _largest(model: mujoco.MjModel, index: int) -> float:
    """Return the largest torque of a motor, within the bound of its joint, N m."""
    joint = int(model.actuator_trnid[index, 0])
    return min(motor_torque(model, index), joint_torque(model, joint))


def gains(
    robot: Robot, control: ControlConfig
) -> tuple[Float[np.ndarray, " nu"], Float[np.ndarray, " nu"]]:
    """Return gains of the PD law, Nm/rad and Nm s/rad: the robot's own, unless the configuration
    has multiples of the torque limit; the motors of one hinge have its gains together."""
    motors, own = Motors.of(robot.model), robot.actuation
    kp = own.stiffness[motors.hinge] * motors.share
    if control.stiffness is not None:
        kp = control.stiffness * motors.limit
    kd = own.damping[motors.hinge] * (kp / own.stiffness[motors.hinge])
    if control.damping is not None:
        kd = control.damping * kp
    return kp, kd


def residual_scale(robot: Robot, control: ControlConfig) -> Float[np.ndarray, " nu"]:
    """Return the radians that a full action moves each motor's target: the robot's action scale,
    unless the configuration has another for all hinges; the arms' may be another still."""
    model = robot.model
    arms = _moved_by(robot, ("left_hand", "right_hand")) - _moved_by(robot, ("head",))
    legs = _moved_by(robot, ("left_foot", "right_foot"))
    joints = model.actuator_trnid[:, 0]
    is_arm = np.array([int(joint) in arms - legs for joint in joints])
    scale: np.ndarray = robot.actuation.action_scale[Motors.of(model).hinge]
    scale = scale * (control.action_factor or 1.0)
    if control.residual is not None:
        scale = np.full_like(scale, control.residual)
    if control.arm_residual is not None:
        scale = np.where(is_arm, control.arm_residual, scale)
    return scale


def feedforward_share(robot: Robot, control: ControlConfig) -> float:
    """Return the share of the reference's torques by which the targets lead: the robot's own,
    unless the configuration has one."""
    named = control.feedforward
    return robot.description.feedforward if named is None else named


def feedback_share(description: RobotDescription, control: ControlConfig) -> float:
    """Return the share of the linear feedback along the reference that the targets get: the robot's
    own, unless the configuration has one."""
    named = control.feedback
    return description.feedback if named is None else named


def feedback_path(robot: Robot, control: ControlConfig) -> FeedbackPath:
    """Return what the feedback keeps the robot on: the robot's own choice, unless the configuration
    has one."""
    return control.feedback_path or robot.description.feedback_path


def actuation_facts(robot: Robot, control: ControlConfig) -> dict[str, list[float]]:
    """Return the scales of a policy's actions, in the robot's order of motors, for its file."""
    kp, kd = gains(robot, control)
    found = {"stiffness": kp, "damping": kd, "action_scale": residual_scale(robot, control)}
    return {name: values.tolist() for name, values in found.items()}


def _moved_by(robot: Robot, keypoints: tuple[str, ...]) -> set[int]:
    """Return the joints between the root and the bodies that carry the keypoints."""
    model, found = robot.model, set()
    for name in keypoints:
        body = model.site_bodyid[robot.keypoint_sites[robot.keypoint_names.index(name)]]
        while body > 0:
            first = model.body_jntadr[body]
            found |= set(range(first, first + model.body_jntnum[body]))
            body = model.body_parentid[body]
    return found
