"""Every number of the tracking environment, with its unit."""

from dataclasses import fields
from typing import Literal

from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.rl.config.paper_config import Curiosity


@config_dataclass
class ControlConfig:
    """The law of control outside the model (stock physics).

    Attributes:
        law: `pd`: a PD law evaluated once a substep. `hold`: the same evaluated once a control
            step, its torque held, as a plain `env.step` does. `torque`: the action is the torque.
        substeps: Physics substeps a control step (Humanoid-v5: 5 of 3 ms).
        stiffness: Proportional gain, multiples of the stock torque limit, 1/rad.
        damping: Derivative gain, multiples of the proportional one, seconds.
        residual: Largest offset that the policy adds to the reference's joint angles, rad.
        arm_residual: The same for the arms: enough to hold them up, too little to balance by
            flailing.
    """

    law: Literal["pd", "hold", "torque"] = "pd"
    substeps: int = Field(default=5, ge=1)
    stiffness: float = Field(default=4.0, gt=0)
    damping: float = Field(default=0.1, ge=0)
    residual: float = Field(default=0.5, gt=0)
    arm_residual: float = Field(default=0.25, gt=0)


@config_dataclass
class ResetConfig:
    """Reference-state initialisation (Peng et al., DeepMimic, 2018) with noise.

    Attributes:
        joint_noise: Standard deviation added to hinge angles, rad.
        joint_speed_noise: Standard deviation added to hinge speeds, rad/s.
        root_speed_noise: Standard deviation added to the root's velocities, m/s and rad/s.
        stand_share: Share of episodes that begin in the default stand instead.
        settled_share: Share that begin in a state which the robot itself reached earlier.
        failure_share: Share of start phases drawn where episodes fail, the rest uniform.
    """

    joint_noise: float = Field(default=0.03, ge=0)
    joint_speed_noise: float = Field(default=0.15, ge=0)
    root_speed_noise: float = Field(default=0.05, ge=0)
    stand_share: float = Field(default=0.1, ge=0, le=1)
    settled_share: float = Field(default=0.3, ge=0, le=1)
    failure_share: float = Field(default=0.5, ge=0, le=1)


@config_dataclass
class RewardConfig:
    """Weights and widths of the local tracking reward; a term is weight * exp(-error^2 / width^2).

    Attributes:
        joints, joints_width: Hinge angles, root mean square, rad.
        sites, sites_width: Keypoint sites relative to the pelvis, root mean square, m.
        hands, hands_width: The hands and the head alone, relative to the pelvis, m.
        orientation, orientation_width: Root orientation, rad.
        velocity, velocity_width: Root linear velocity, m/s.
        joint_speed, joint_speed_width: Hinge speeds, root mean square, rad/s.
        limb_speed, limb_speed_width: Velocities of feet, hands and head, root mean square, m/s:
            keeps a robot from balancing by flailing or stepping where the dancer stands.
        height, height_width: Root height, m.
        drift, drift_width: Root position, m.
        action_rate: Penalty on the mean squared change of the action.
        fine: Share of every term that is paid by a narrower bell: the wide one shows the way from
            afar, the narrow one still pays for the last centimetre.
        narrow: Width of the narrower bell, in widths of the wide one.
        curiosity: As the paper's; scaled so that a perfect step earns the same share of it.
    """

    joints: float = 0.20
    joints_width: float = Field(default=0.25, gt=0)
    sites: float = 0.15
    sites_width: float = Field(default=0.10, gt=0)
    hands: float = 0.10
    hands_width: float = Field(default=0.12, gt=0)
    orientation: float = 0.10
    orientation_width: float = Field(default=0.4, gt=0)
    velocity: float = 0.05
    velocity_width: float = Field(default=0.6, gt=0)
    joint_speed: float = 0.05
    joint_speed_width: float = Field(default=2.0, gt=0)
    limb_speed: float = 0.20
    limb_speed_width: float = Field(default=0.6, gt=0)
    height: float = 0.10
    height_width: float = Field(default=0.1, gt=0)
    drift: float = 0.10
    drift_width: float = Field(default=0.3, gt=0)
    action_rate: float = 0.02
    fine: float = Field(default=0.5, ge=0, le=1)
    narrow: float = Field(default=0.35, gt=0, le=1)
    curiosity: Curiosity = "off"

    @classmethod
    def terms(cls) -> tuple[str, ...]:
        """Return the names of the terms: the fields that have a width."""
        names = tuple(field.name for field in fields(cls))
        return tuple(name for name in names if f"{name}_width" in names)

    @property
    def perfect(self) -> float:
        """What a step earns that equals the reference."""
        result: float = sum(getattr(self, name) for name in self.terms())
        return result


@config_dataclass
class TerminationConfig:
    """When an episode ends early. The fall rule is the paper's; the others are for training only.

    Attributes:
        fall_height: Torso lower than this is a fall, m.
        fall_tilt: Torso tilted more than this is a fall, rad (60 degrees).
        orientation: Largest root orientation error, rad.
        height: Largest root height error, m.
        sites: Largest mean site error relative to the pelvis, m.
        drift: Largest root position error, m.
    """

    fall_height: float = 0.7
    fall_tilt: float = 1.0471975511965976
    orientation: float = 1.0
    height: float = 0.25
    sites: float = 0.30
    drift: float = 1.5


@config_dataclass
class RandomConfig:
    """Physics that differ a little from robot to robot while training; zero is the stock robot.

    Attributes:
        friction: Half-width of a uniform factor on the friction of all geoms.
        gains: The same on stiffness and damping of the PD law.
        integrators: Robot i gets the i-th, over and over.
    """

    friction: float = Field(default=0.0, ge=0, lt=1)
    gains: float = Field(default=0.0, ge=0, lt=1)
    integrators: tuple[Literal["RK4", "Euler", "implicitfast"], ...] = Field(
        default=("RK4",), min_length=1
    )


@config_dataclass
class TrackConfig:
    """The tracking environment.

    Attributes:
        episode_seconds: Time limit of a training episode, s; its end is bootstrapped.
        threads: Threads that step the simulations.
    """

    control: ControlConfig = Field(default_factory=ControlConfig)
    reset: ResetConfig = Field(default_factory=ResetConfig)
    reward: RewardConfig = Field(default_factory=RewardConfig)
    termination: TerminationConfig = Field(default_factory=TerminationConfig)
    random: RandomConfig = Field(default_factory=RandomConfig)
    episode_seconds: float = Field(default=6.0, gt=0)
    threads: int = Field(default=2, ge=1)
