"""Settings of a performance."""

from pydantic import Field

from robojackson.config import config_dataclass


@config_dataclass
class PerformanceConfig:
    """Settings of a performance.

    Attributes:
        runs: Number of runs; they differ in the times and directions of pushes.
        seed: Seed of the first run; the others have the following ones.
        pushes: Pushes every 1 to 3 s, multiples of mjlab's, unitless; those of the passport are 1.
        carried_m, turned_rad: From the programme, beyond which a robot follows it from where it is
            on.
        doubt_rad: Tilt away from the programme's, from which it is simulated ahead whether a robot
            falls, and whether it would if it gave its part up.
        ahead_s: How far ahead.
        look_s: How often.
        calm_rad: Tilt away from the stand, below which for `calm_s` it goes on with the next part.
        threads: Threads that step the simulations.
    """

    runs: int = Field(default=8, ge=1)
    seed: int = Field(default=0, ge=0)
    pushes: float = Field(default=1.0, ge=0, le=10)
    carried_m: float = Field(default=0.3, gt=0)
    turned_rad: float = Field(default=0.5, gt=0)
    doubt_rad: float = Field(default=0.08, gt=0)
    ahead_s: float = Field(default=3.0, gt=0)
    look_s: float = Field(default=0.06, gt=0)
    calm_rad: float = Field(default=0.15, gt=0)
    calm_s: float = Field(default=1.0, gt=0)
    threads: int = Field(default=2, ge=1)
