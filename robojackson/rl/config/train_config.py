"""Configuration of training and evaluation, every number with its unit. A setup file holds only
differences."""

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator
from pydantic_core import ArgsKwargs

from robojackson.config import config_dataclass
from robojackson.errors import ConflictingValues
from robojackson.rl.config.evaluate_config import EvaluateConfig
from robojackson.rl.config.paper_config import Curiosity, PaperConfig
from robojackson.rl.config.tqc_config import TqcConfig
from robojackson.rl.config.track_config import (
    ControlConfig,
    RandomConfig,
    ResetConfig,
    RewardConfig,
    TerminationConfig,
    TrackConfig,
)

__all__ = [
    "ControlConfig",
    "EvaluateConfig",
    "PaperConfig",
    "RandomConfig",
    "ResetConfig",
    "RewardConfig",
    "TerminationConfig",
    "TqcConfig",
    "TrackConfig",
    "TrainConfig",
]

BUDGETS = ("steps", "minutes", "cpu_minutes")
"""Keys of the budgets of a training."""


def longer_budgets(config: "TrainConfig") -> dict[str, str]:
    """Return twice the budgets of a training, by key path of a pass; nothing where it has none."""
    given = {f"train.{name}": getattr(config, name) for name in BUDGETS}
    return {key: f"{2 * value:.12g}" for key, value in given.items() if value is not None}


@config_dataclass
class TrainConfig:
    """One training run. It ends at the first of its budgets that is reached.

    Attributes:
        mode: `track`, our method, or `paper`, the paper's own.
        trainer: `sbx` (JAX, fast) or `sb3` (sb3-contrib, the reference).
        seed: Seed of networks, environments and replay.
        steps: Policy steps over all simulations, rounded up to a round of updates.
        minutes: Wall time, minutes.
        cpu_minutes: Processor time, all threads together, minutes.
        start: Source of the networks: `scratch`, our `walker` of the mode, our `dancer` of the
            Unitree G1 (use the setup `pretrained-dancer`), a networks.safetensors, an SB3 zip, or a
            repository of the hub (`owner/name`); or a policy.safetensors, an actor alone, which
            explores with `tqc.log_std_init` and waits for its critics for `tqc.burn_in`.
        start_critics: Whether the critics come from the same source.
        polish: Whether the training starts from what the feedback alone does and improves it
            (preset `polish` of TQC). `auto`: from scratch, on a robot whose feedback follows a
            sampled path (`track.control.feedback_path`), where the motion does not repeat or the
            feedback alone, of the exact root, holds the robot from nine tenths of the starts. At
            the end the feedback alone becomes the policy where it holds more starts, or as many
            more closely.
        curiosity: Which of the paper's three weights the curiosity bonus gets.
        checkpoint_seconds: Time between two checkpoints, s.
        progress_seconds: Time between two progress rows, s.
        tensorboard: Whether to log for TensorBoard: in `tensorboard` beside the policy, or of a
            pass or a study in `tensorboard/RUN` of the store. What is cached is not logged again.
    """

    mode: Literal["track", "paper"] = "track"
    trainer: Literal["sbx", "sb3"] = "sbx"
    seed: int = Field(default=0, ge=0, lt=2**31)
    steps: int | None = Field(default=None, ge=1)
    minutes: float | None = Field(default=None, gt=0)
    cpu_minutes: float | None = Field(default=None, gt=0)
    start: str = Field(default="scratch", min_length=1)
    start_critics: bool = True
    polish: Literal["auto", "no"] = "auto"
    curiosity: Curiosity = "off"
    checkpoint_seconds: Annotated[float, Field(gt=0)] = field(default=60.0, compare=False)
    progress_seconds: Annotated[float, Field(gt=0)] = field(default=5.0, compare=False)
    tensorboard: bool = field(default=False, compare=False)
    track: TrackConfig = Field(default_factory=TrackConfig)
    paper: PaperConfig = Field(default_factory=PaperConfig)
    tqc: TqcConfig = Field(default_factory=TqcConfig)

    @model_validator(mode="before")
    @classmethod
    def _tqc_of_mode(cls, given: Any) -> Any:
        """Set the paper's TQC in paper mode unless another preset is named."""
        keys: Any = given.kwargs if isinstance(given, ArgsKwargs) else given
        if not isinstance(keys, Mapping) or keys.get("mode") != "paper":
            return given
        tqc = keys.get("tqc", {})
        if not isinstance(tqc, Mapping) or "preset" in tqc:
            return given
        keys = {**keys, "tqc": {"preset": "paper", **tqc}}
        return ArgsKwargs(given.args, keys) if isinstance(given, ArgsKwargs) else keys

    @model_validator(mode="after")
    def _one_curiosity(self) -> "TrainConfig":
        inner = {"paper": self.paper.curiosity, "track.reward": self.track.reward.curiosity}
        for name, weight in inner.items():
            if weight not in ("off", self.curiosity):
                raise ConflictingValues(
                    f"{name}.curiosity: set curiosity={weight} instead, for either mode",
                    f"{name}.curiosity",
                )
        return self

    @model_validator(mode="after")
    def _whole_delays(self) -> "TrainConfig":
        updates, delay = self.tqc.updates_per_round, self.tqc.policy_delay
        if self.trainer == "sbx" and updates % delay:
            raise ConflictingValues(
                f"tqc.updates_per_round, {updates}, must be a multiple of tqc.policy_delay, "
                f"{delay}",
                "tqc.updates_per_round",
                "tqc.policy_delay",
            )
        return self

    @model_validator(mode="after")
    def _residual_learning(self) -> "TrainConfig":
        start = self.tqc.actor_start
        given = (start.zero_init, start.burn_in, start.action_penalty)
        if self.trainer == "sb3" and any(given):
            raise ConflictingValues(
                "tqc.zero_init, burn_in and action_penalty (of preset polish or setup "
                "pretrained-dancer) need trainer sbx",
                "trainer",
                "tqc",
            )
        return self

    @model_validator(mode="after")
    def _same_inputs(self) -> "TrainConfig":
        if self.track.differences and self.mode == "track" and self.start != "scratch":
            raise ConflictingValues(
                "track.differences needs start scratch: files hold networks of the observation "
                "itself",
                "track.differences",
                "start",
            )
        return self

    @property
    def has_budget(self) -> bool:
        """Return whether the training has a budget."""
        return any(getattr(self, name) is not None for name in BUDGETS)

    @property
    def environment(self) -> TrackConfig | PaperConfig:
        """Return the environment of the mode, with the curiosity of the setup."""
        if self.mode == "paper":
            return replace(self.paper, curiosity=self.curiosity)
        reward = replace(self.track.reward, curiosity=self.curiosity)
        return replace(self.track, reward=reward)
