"""Every number of training and evaluation, with its unit. A setup file holds only what differs."""

from typing import Literal

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

STRICT = ConfigDict(extra="forbid")


@dataclass(frozen=True, config=STRICT)
class ControlConfig:
    """The PD law outside the model, evaluated once a substep (stock physics).

    Attributes:
        substeps: Physics substeps a control step (Humanoid-v5: 5 of 3 ms).
        stiffness: Proportional gain, multiples of the stock torque limit, 1/rad.
        damping: Derivative gain, multiples of the proportional one, seconds.
        residual: Largest offset that the policy adds to the reference's joint angles, rad.
        arm_residual: The same for the arms: enough to hold them up, too little to balance by
            flailing.
    """

    substeps: int = Field(default=5, ge=1)
    stiffness: float = Field(default=4.0, gt=0)
    damping: float = Field(default=0.1, ge=0)
    residual: float = Field(default=0.5, gt=0)
    arm_residual: float = Field(default=0.25, gt=0)


@dataclass(frozen=True, config=STRICT)
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


@dataclass(frozen=True, config=STRICT)
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
    """

    joints: float = 0.20
    joints_width: float = 0.25
    sites: float = 0.15
    sites_width: float = 0.10
    hands: float = 0.10
    hands_width: float = 0.12
    orientation: float = 0.10
    orientation_width: float = 0.4
    velocity: float = 0.05
    velocity_width: float = 0.6
    joint_speed: float = 0.05
    joint_speed_width: float = 2.0
    limb_speed: float = 0.20
    limb_speed_width: float = 0.6
    height: float = 0.10
    height_width: float = 0.1
    drift: float = 0.05
    drift_width: float = 0.5
    action_rate: float = 0.02


@dataclass(frozen=True, config=STRICT)
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


@dataclass(frozen=True, config=STRICT)
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
    episode_seconds: float = Field(default=6.0, gt=0)
    threads: int = Field(default=2, ge=1)


@dataclass(frozen=True, config=STRICT)
class TqcConfig:
    """TQC (Kuznetsov et al., 2020) and how often it learns.

    Attributes:
        n_envs: Simulations stepped together.
        steps_per_round: Control steps of every simulation between two rounds of updates.
        updates_per_round: Gradient updates a round.
        buffer: Transitions kept for replay.
        warmup: Random transitions before the first update.
        refill: Transitions of the restored policy before the first update of a run that is resumed
            without its replay buffer.
        critics: SBX has two, and so has the reference.
        top_quantiles_to_drop: Of each critic's quantiles, against overestimation.
    """

    n_envs: int = Field(default=32, ge=1)
    steps_per_round: int = Field(default=8, ge=1)
    updates_per_round: int = Field(default=24, ge=1)
    learning_rate: float = Field(default=5e-4, gt=0)
    buffer: int = Field(default=300_000, ge=1_000)
    warmup: int = Field(default=2_000, ge=1)
    refill: int = Field(default=20_000, ge=1)
    batch: int = Field(default=256, ge=1)
    tau: float = Field(default=0.01, gt=0, le=1)
    gamma: float = Field(default=0.985, gt=0, lt=1)
    policy_delay: int = Field(default=2, ge=1)
    critics: Literal[2] = 2
    quantiles: int = Field(default=25, ge=1)
    top_quantiles_to_drop: int = Field(default=2, ge=0)
    entropy: str = Field(default="auto_0.02", pattern=r"^auto(_\d*\.?\d+)?$")
    actor: tuple[int, ...] = (256, 256)
    critic: tuple[int, ...] = (256, 256)


@dataclass(frozen=True, config=STRICT)
class TrainConfig:
    """One training run. It ends at the first of `steps` and `minutes` that is reached.

    Attributes:
        trainer: `sbx` (JAX, fast) or `sb3` (sb3-contrib, the reference).
        seed: Of networks, environments and replay.
        steps: Control steps over all simulations.
        minutes: Wall time, minutes.
        checkpoint_seconds: Time between two checkpoints, s.
        progress_seconds: Time between two progress rows, s.
    """

    trainer: Literal["sbx", "sb3"] = "sbx"
    seed: int = Field(default=0, ge=0)
    steps: int | None = Field(default=None, ge=1)
    minutes: float | None = Field(default=None, gt=0)
    checkpoint_seconds: float = Field(default=60.0, gt=0)
    progress_seconds: float = Field(default=5.0, gt=0)
    track: TrackConfig = Field(default_factory=TrackConfig)
    tqc: TqcConfig = Field(default_factory=TqcConfig)


@dataclass(frozen=True, config=STRICT)
class EvaluateConfig:
    """How a policy is judged on stock physics.

    Attributes:
        seconds: Length of a rollout on a cyclic clip, s; others run to their end.
        phases: Start phases, spread evenly over the clip.
        resets: Noisy starts a phase.
        seed: Of the noise.
        joint_noise, joint_speed_noise, root_speed_noise: Reset noise, rad, rad/s, m/s.
        strict_error: Largest mean site error of a strict success, m.
        kneel_height: A knee lower than this is kneeling, m.
        fast: Reference speed from which a limb's gain is measured, m/s.
        max_lag: Longest lag tried for a limb's gain, s.
    """

    seconds: float = Field(default=10.0, gt=0)
    phases: int = Field(default=24, ge=1)
    resets: int = Field(default=3, ge=1)
    seed: int = 0
    joint_noise: float = 0.02
    joint_speed_noise: float = 0.1
    root_speed_noise: float = 0.02
    strict_error: float = 0.30
    kneel_height: float = 0.15
    fast: float = 0.15
    max_lag: float = 0.1
    threads: int = 2
