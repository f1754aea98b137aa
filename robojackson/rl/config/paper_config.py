"""The paper's environment as data: every weight of its reward, its rules, and the presets.

`paper` is the reward as the paper writes it. `released` is the sum of the authors' released code:
Humanoid-v5's own reward of each of four repeats beside it, 3.0 x 1.5 for standing upright, a ramp
to 10 instead of 1, and a motion cut to 100 frames of 30 a second. `walker` is Humanoid-v5 alone.
"""

from typing import Any, Literal

from pydantic import Field, model_validator

from robojackson.config import config_dataclass
from robojackson.errors import ConflictingValues
from robojackson.rl.config.presets import with_preset

Curiosity = Literal["off", "formula", "algorithm", "released"]
BETA: dict[Curiosity, float] = {"off": 0.0, "formula": 0.1, "algorithm": 0.05, "released": 0.01}
"""The three weights of the paper's formula, its Algorithm 2 and the released code."""
NEVER = 1e9

PRESETS: dict[str, dict[str, Any]] = {
    "paper": {},
    "released": {
        "lambda_max": 10.0,
        "upright": 4.5,
        "own": 1.0,
        "curiosity_of": "bodies",
        "repeats": 4,
        "seconds": 100 / 30,
    },
    "walker": {
        "imitation": 0.0,
        "upright": 0.0,
        "balance": 0.0,
        "own": 1.0,
        "fall_penalty": 0.0,
        "fall_height": 1.0,
        "fall_tilt": NEVER,
        "highest": 2.0,
        "seconds": 15.0,
    },
}

POINT_WEIGHTS = {
    "pelvis": 0.5,
    "left_hip": 1.0,
    "right_hip": 1.0,
    "left_knee": 1.5,
    "right_knee": 1.5,
    "left_foot": 1.0,
    "right_foot": 1.0,
    "lwaist": 0.3,
    "torso": 0.3,
    "head": 0.3,
    "left_shoulder": 1.0,
    "right_shoulder": 1.0,
    "left_elbow": 1.5,
    "right_elbow": 1.5,
    "left_hand": 2.0,
    "right_hand": 2.0,
}
"""Keypoints and bodies; lwaist replaces the spine, torso the neck, a foot an ankle and a hand a
wrist."""


@config_dataclass
class PaperConfig:
    """The paper's task on stock Humanoid-v5: torques, 348 observations, no phase.

    Attributes:
        preset: Source of the numbers that are not given.
        imitation: Weight of the imitation term; lambda ramps it.
        relative: Whether the points are compared relative to the pelvis (`root`) or in the world
            (`world`); the table of episodes has both distances.
        weights: Weights of the squared distances, by keypoint or body.
        lambda_min: Least lambda = max(min, max * min(1, episode / ramp)), unitless.
        lambda_max: Largest lambda, unitless.
        ramp_episodes: Episodes over which it grows.
        upright: Weight of max(0, z . g), the torso's axis against gravity.
        balance: Weight of 1 / (1 + |COM_xy - pelvis_xy|), distances in metres, unitless.
        own: Weight of Humanoid-v5's own reward, summed over the repeats, unitless.
        curiosity: Weight of the sum of absolute speeds.
        curiosity_of: Speeds of the `hinges`, or angular speeds of all `bodies`, rad/s.
        fall_penalty: Reward that is subtracted once at a fall, unitless.
        fall_height: Torso lower than this is a fall, m.
        fall_tilt: Torso tilted more than this is a fall, rad.
        highest: Torso higher than this ends the episode too, m.
        early_fall: Policy steps below which a fall counts as early.
        repeats: Control steps for which an action is held.
        seconds: Length of a cyclic clip's episode, and the limit of any other, s.
        observe: Humanoid-v5's 348 numbers (`stock`), or only the first 45 of them, positions and
            velocities (`joints`), which train faster; `network_arrays.widened` supplies the rest.
        reset_noise: Uniform noise on the state of the stock reset, SI units.
        threads: Threads that step the simulations.
    """

    preset: Literal["paper", "released", "walker"] = "paper"
    imitation: float = Field(default=1.0, ge=0)
    relative: Literal["root", "world"] = "root"
    weights: dict[str, float] = Field(default_factory=lambda: dict(POINT_WEIGHTS))
    lambda_min: float = Field(default=0.1, ge=0)
    lambda_max: float = Field(default=1.0, ge=0)
    ramp_episodes: int = Field(default=1000, ge=1)
    upright: float = 3.0
    balance: float = 2.0
    own: float = 0.0
    curiosity: Curiosity = "off"
    curiosity_of: Literal["hinges", "bodies"] = "hinges"
    fall_penalty: float = Field(default=200.0, ge=0)
    fall_height: float = 0.7
    fall_tilt: float = 1.0471975511965976
    highest: float = NEVER
    early_fall: int = 20
    repeats: int = Field(default=1, ge=1)
    seconds: float = Field(default=10.0, gt=0)
    observe: Literal["stock", "joints"] = "stock"
    reset_noise: float = Field(default=0.01, ge=0)
    threads: int = Field(default=1, ge=1)

    @model_validator(mode="before")
    @classmethod
    def _preset(cls, given: Any) -> Any:
        return with_preset(given, PRESETS, "paper")

    @model_validator(mode="after")
    def _weighed(self) -> "PaperConfig":
        if any(weight < 0 for weight in self.weights.values()) or not any(self.weights.values()):
            raise ConflictingValues(
                "weights: none may be negative, and one at least must count", "weights"
            )
        return self
