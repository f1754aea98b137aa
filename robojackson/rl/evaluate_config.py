"""Every number of an evaluation, with its unit."""

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
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
