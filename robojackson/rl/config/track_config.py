"""Configuration of the tracking environment, every number with its unit."""

from dataclasses import fields
from typing import Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field, model_validator

from robojackson.config import config_dataclass
from robojackson.errors import ConflictingValues
from robojackson.rl.config.paper_config import Curiosity
from robojackson.robot.description import FeedbackPath


@config_dataclass
class ControlConfig:
    """The law of control outside the model (stock physics).

    Attributes:
        law: `pd`: a PD law evaluated once a substep. `hold`: the same evaluated once a control
            step, its torque held, as a plain `env.step` does. `torque`: the action is the torque
            (mode `paper` alone).
        substeps: Physics substeps a control step; the robot's when null.
        stiffness: Proportional gain, multiples of the torque limit, 1/rad; the robot's own gains
            when null.
        damping: Derivative gain, multiples of the proportional one, seconds; the robot's when
            null.
        feedforward: Share of the reference's torques by which the targets lead its joint angles,
            unitless; 0 follows the angles alone; the robot's when null.
        feedback: Share of the linear-quadratic feedback along the reference by which the targets
            move, unitless; 0 leaves balance to the policy alone; when null the robot's, or 0 for
            `preview` and `full_preview`.
        root_state: Place and velocity of the root in the feedback: `exact`, as a simulation knows
            them, or `estimated` from a robot's own measurements (`rl.sim.leg_odometry`); when null
            as the policy sees them: `exact`, or `estimated` for `onboard` and `preview`.
        feedback_path: What the feedback keeps the robot on: the `reference`, or, where that falls,
            a path beside it that simulations with `sampled` offsets have found, wherever the feet
            stand; the robot's when null.
        residual: Largest offset that the policy adds to the reference's joint angles, rad; the
            robot's action scale when null.
        action_factor: Factor on the robot's action scale; when null 1, or the robot's
            `robust_action_factor` where the training pushes it.
        arm_residual: Largest offset that the policy adds to the arms' angles, rad.
    """

    law: Literal["pd", "hold", "torque"] = "pd"
    substeps: int | None = Field(default=None, ge=1)
    stiffness: float | None = Field(default=None, gt=0)
    damping: float | None = Field(default=None, ge=0)
    feedforward: float | None = Field(default=None, ge=0, le=2)
    feedback: float | None = Field(default=None, ge=0, le=2)
    root_state: Literal["exact", "estimated"] | None = None
    feedback_path: FeedbackPath | None = None
    residual: float | None = Field(default=None, gt=0)
    arm_residual: float | None = Field(default=None, gt=0)
    action_factor: float | None = Field(default=None, gt=0)


@config_dataclass
class ResetConfig:
    """Reference-state initialisation (Peng et al., DeepMimic, 2018) with noise.

    Attributes:
        joint_noise: Standard deviation added to hinge angles, rad.
        joint_speed_noise: Standard deviation added to hinge speeds, rad/s.
        root_speed_noise: Standard deviation added to the root's velocities, m/s and rad/s.
        stand_share: Share of episodes that begin in the default stand instead.
        settled_share: Share that begin in a state which the robot itself reached before.
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
        joints: Weight of the hinge angles, unitless.
        joints_width: Width for hinge angles, root mean square, rad.
        sites: Weight of the keypoint sites, unitless.
        sites_width: Width for sites relative to the pelvis, root mean square, m.
        hands: Weight of the hands and the head alone, unitless.
        hands_width: Width for them, relative to the pelvis, m.
        feet: Weight of the places of feet and toes, unitless.
        feet_width: Width for these, over the floor relative to the pelvis, in height as they are,
            root mean square, m.
        bodies: Weight of the orientations of all bodies, unitless.
        bodies_width: Width for these, root mean square, rad.
        orientation: Weight of the root orientation, unitless.
        orientation_width: Width for it, rad.
        velocity: Weight of the root linear velocity, unitless.
        velocity_width: Width for it, m/s.
        joint_speed: Weight of the hinge speeds, unitless.
        joint_speed_width: Width for hinge speeds, root mean square, rad/s.
        limb_speed: Weight of the velocities of feet, hands and head, unitless; keeps a robot from
            balancing by flailing or stepping where the dancer stands.
        limb_speed_width: Width for these velocities, root mean square, m/s.
        height: Weight of the root height, unitless.
        height_width: Width for it, m.
        drift: Weight of the root position, unitless.
        drift_width: Width for it, m.
        action_rate: Penalty on the mean squared change of the action, unitless.
        fine: Share of every term that is paid by a narrower bell: the wide one guides from afar,
            the narrow one still pays for the last centimetre.
        narrow: Width of the narrower bell, in widths of the wide one.
        polished_fine: Share that the narrower bell pays in a training that improves what the
            feedback alone does.
        polished_narrow: Width of the narrower bell there, in widths of the wide one.
        curiosity: Curiosity bonus of the paper, scaled so that a perfect step earns the same share
            of it.
    """

    joints: float = 0.20
    joints_width: float = Field(default=0.25, gt=0)
    sites: float = 0.15
    sites_width: float = Field(default=0.10, gt=0)
    hands: float = 0.10
    hands_width: float = Field(default=0.12, gt=0)
    feet: float = 0.0
    feet_width: float = Field(default=0.08, gt=0)
    bodies: float = 0.0
    bodies_width: float = Field(default=0.4, gt=0)
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
    polished_fine: float = Field(default=0.8, ge=0, le=1)
    polished_narrow: float = Field(default=0.15, gt=0, le=1)
    curiosity: Curiosity = "off"

    @classmethod
    def terms(cls) -> tuple[str, ...]:
        """Return the names of the terms: the fields that have a width."""
        names = tuple(field.name for field in fields(cls))
        return tuple(name for name in names if f"{name}_width" in names)

    @property
    def perfect(self) -> float:
        """Return the reward of a step that equals the reference."""
        result: float = sum(getattr(self, name) for name in self.terms())
        return result


@config_dataclass
class TerminationConfig:
    """Conditions that end an episode early. The fall rule is the robot's; the others are for
    training only.

    Attributes:
        fall_height: Height of the robot's fall rule, m; the robot's own when null.
        fall_tilt: Tilt of the robot's fall rule, rad; the robot's own when null.
        orientation: Largest root orientation error, rad.
        height: Largest root height error, m.
        sites: Largest mean site error relative to the pelvis, m.
        drift: Largest root position error, m.
    """

    fall_height: float | None = Field(default=None, ge=0)
    fall_tilt: float | None = Field(default=None, gt=0)
    orientation: float = 1.0
    height: float = 0.25
    sites: float = 0.30
    drift: float = 1.5


@config_dataclass
class RandomConfig:
    """Ranges of physics in training; zero is the stock robot.

    Attributes:
        friction: Half-width of a uniform factor on the friction of all geoms, unitless.
        gains: Half-width of a uniform factor on stiffness and damping of the PD law, unitless.
        mass: Half-width of a uniform factor on mass and inertia of all bodies, unitless.
        com: Half-width of a uniform shift of the root body's centre of mass, each axis, m.
        delay: Largest delay of an action, uniform, at most a control step, s.
        sensor_noise: Noise of the policy's inputs, multiples of mjlab's, unitless.
        pushes: Pushes every 1 to 3 s, multiples of mjlab's, unitless.
        integrators: Robot i gets the i-th, repeatedly; with no names, all have the robot's own.
        least: Share of these ranges that the first robot of a training has; they grow evenly up to
            the last one's, which are whole. 1 gives all robots the whole ranges.
    """

    friction: float = Field(default=0.0, ge=0, lt=1)
    gains: float = Field(default=0.0, ge=0, lt=1)
    mass: float = Field(default=0.0, ge=0, lt=1)
    com: float = Field(default=0.0, ge=0, le=0.2)
    delay: float = Field(default=0.0, ge=0, le=0.1)
    sensor_noise: float = Field(default=0.0, ge=0, le=10)
    pushes: float = Field(default=0.0, ge=0, le=10)
    integrators: tuple[Literal["RK4", "Euler", "implicit", "implicitfast"], ...] = ()
    least: float = Field(default=1.0, ge=0, le=1)

    def shares(self, n: int) -> Float[np.ndarray, " n"]:
        """Return the share of the ranges that each of n robots has."""
        return np.linspace(self.least, 1.0, n) if n > 1 else np.ones(n)


@config_dataclass
class TrackConfig:
    """The tracking environment.

    Attributes:
        observation: Inputs of the policy: `full`, everything that a simulation knows; `onboard`,
            the measurements of a real robot (the critics see everything); `preview`, these and
            the reference ahead; or `full_preview`, everything and the reference ahead.
        differences: Whether a policy of `onboard` sees hinge angles and speeds as differences from
            the reference alone, so that what it learns holds for other motions, too.
        episode_seconds: Time limit of a training episode, s; its end is bootstrapped.
        threads: Threads that step the simulations.
    """

    observation: Literal["full", "onboard", "preview", "full_preview"] = "full"
    differences: bool = False
    control: ControlConfig = Field(default_factory=ControlConfig)
    reset: ResetConfig = Field(default_factory=ResetConfig)
    reward: RewardConfig = Field(default_factory=RewardConfig)
    termination: TerminationConfig = Field(default_factory=TerminationConfig)
    random: RandomConfig = Field(default_factory=RandomConfig)
    episode_seconds: float = Field(default=6.0, gt=0)
    threads: int = Field(default=2, ge=1)

    @model_validator(mode="after")
    def _goes_together(self) -> "TrackConfig":
        if self.control.law == "torque":
            raise ConflictingValues("law torque is of mode paper: take pd or hold", "control.law")
        if self.differences and self.observation != "onboard":
            reason = "differences is for observation onboard; the others have more of the reference"
            raise ConflictingValues(reason, "differences", "observation")
        return self
