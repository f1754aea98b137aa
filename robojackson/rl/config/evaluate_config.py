"""Every number of an evaluation, with its unit."""

from pydantic import Field

from robojackson.config import config_dataclass

TRAINED, HOLD, REGULATOR = "trained", "hold", "regulator"
VARIANTS = (HOLD, REGULATOR)
"""Names in tables: the trained policy, the same under another control law, and the feedback of its
control law without the policy."""


@config_dataclass
class EvaluateConfig:
    """Settings of an evaluation on stock physics.

    Attributes:
        seconds: Length of a rollout on a cyclic clip, s; others run to their end.
        phases: Start phases, spread evenly over the clip.
        resets: Noisy starts a phase.
        seed: Seed of the noise.
        joint_noise: Reset noise of hinge angles, rad.
        joint_speed_noise: Reset noise of hinge speeds, rad/s.
        root_speed_noise: Reset noise of the root's velocity, m/s.
        strict_error: Largest mean site error of a strict success, m; the robot's when null.
        kneel_height: A knee lower than this is kneeling, m; the robot's when null.
        fast: Reference speed from which a limb's gain is measured, m/s.
        passport: Whether to evaluate the policy also under other physics, delays, noise and pushes.
        max_lag: Longest lag tried for a limb's gain, s.
        threads: Threads that step the simulations.
    """

    seconds: float = Field(default=10.0, gt=0, le=3600)
    phases: int = Field(default=24, ge=1)
    resets: int = Field(default=3, ge=1)
    seed: int = Field(default=0, ge=0, lt=2**32)
    joint_noise: float = Field(default=0.02, ge=0)
    joint_speed_noise: float = Field(default=0.1, ge=0)
    root_speed_noise: float = Field(default=0.02, ge=0)
    strict_error: float | None = Field(default=None, gt=0)
    kneel_height: float | None = Field(default=None, gt=0)
    fast: float = Field(default=0.15, gt=0)
    max_lag: float = Field(default=0.1, ge=0)
    passport: bool = False
    threads: int = Field(default=2, ge=1)
