"""Requirements of training on a robot: torque motors, stable gains, a stand that is no fall."""

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from robojackson.errors import BadConfiguration
from robojackson.rl.config.train_config import ControlConfig, TrainConfig
from robojackson.rl.sim.motors import Motors, gains
from robojackson.robot.description_check import unstable_gains
from robojackson.robot.fall import Fall, standing_height
from robojackson.robot.model import Robot


def require_trainable(robot: Robot, config: TrainConfig | None = None) -> None:
    """Raise for a robot without usable motors or gains, or whose stand counts as a fall.

    Args:
        config: The training, whose control law may have gains of its own; in mode paper policies
            give torques, and gains do not count. The robot's own gains when None.
    Raises:
        BadConfiguration: it has no torque motors with a range, it is too small, or its gains are
            unstable.
    """
    model, reason, fall = robot.model, "", Fall.of(robot)
    motors = _torque_motors(model)
    low, high = model.actuator_ctrlrange[:, 0], model.actuator_ctrlrange[:, 1]
    height = standing_height(robot)
    if not model.nu:
        reason = "neither its MJCF nor torque_limits of its YAML give it motors"
    elif not motors.all():
        name = model.actuator(int(np.argmin(motors))).name
        reason = f"actuator {name!r} is not a torque motor with a control range"
    elif not np.allclose(low, -high):
        name = model.actuator(int(np.argmax(np.abs(low + high)))).name
        reason = f"the control range of motor {name!r} is not the same in both directions"
    elif not (both := _both_directions(model)).all():
        name = model.actuator(int(np.argmin(both))).name
        reason = f"the force range of motor {name!r} or of its joint allows one direction alone"
    elif not fall.relative and height < fall.height:
        reason = (
            f"it stands with its root {height:.2f} m above the floor, and less than "
            f"{fall.height:g} m counts as a fall (fall.height of its YAML)"
        )
    elif config is None or config.mode == "track":
        control = ControlConfig() if config is None else config.track.control
        reason = next(unstable_gains(robot, *_damping(robot, control)), "")
    if reason:
        raise BadConfiguration(
            f"training is not possible on robot {robot.description.name!r} yet: {reason}; "
            "retargeting, its video and export are"
        )


def _damping(robot: Robot, control: ControlConfig) -> tuple[Float[np.ndarray, " J"], str]:
    """Return the derivative gain of each hinge under a control law, and where it is set."""
    hinges, (_, damping) = Motors.of(robot.model).hinge, gains(robot, control)
    set_by_hand = control.stiffness is not None or control.damping is not None
    found = np.bincount(hinges, damping, len(robot.joint_names))
    return found, "track.control.damping" if set_by_hand else ""


def _both_directions(model: mujoco.MjModel) -> Bool[np.ndarray, " nu"]:
    """Return whether the force ranges of each motor and of its joint have both directions."""
    joint = model.actuator_trnid[:, 0]
    own = _around_zero(model.actuator_forcerange) | (model.actuator_forcelimited == 0)
    bound = _around_zero(model.jnt_actfrcrange) | (model.jnt_actfrclimited == 0)
    result: np.ndarray = own & bound[joint]
    return result


def _around_zero(ranges: Float[np.ndarray, "N 2"]) -> Bool[np.ndarray, " N"]:
    return np.asarray((ranges[:, 0] < 0) & (ranges[:, 1] > 0))


def _torque_motors(model: mujoco.MjModel) -> Bool[np.ndarray, " nu"]:
    """Return whether each actuator is a joint's motor whose torque is proportional to its control,
    at once and within a range."""
    usable: np.ndarray = (
        (model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT))
        & (model.actuator_biastype == int(mujoco.mjtBias.mjBIAS_NONE))
        & (model.actuator_gaintype == int(mujoco.mjtGain.mjGAIN_FIXED))
        & (model.actuator_dyntype == int(mujoco.mjtDyn.mjDYN_NONE))
        & (model.actuator_gear[:, 0] * model.actuator_gainprm[:, 0] != 0)
        & (model.actuator_ctrllimited > 0)
    )
    return usable
