"""The numbers of TQC (Kuznetsov et al., 2020), with presets of the paper and its released code."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, model_validator

from robojackson.config import config_dataclass
from robojackson.errors import ConflictingValues
from robojackson.rl.config.presets import with_preset

PRESETS: dict[str, dict[str, Any]] = {
    "dance": {},
    # The paper names TQC and 50,000 steps; the rest is sb3-contrib's defaults, its update
    # after every step as 32 after 32.
    "paper": {
        "n_envs": 1,
        "steps_per_round": 32,
        "updates_per_round": 32,
        "learning_rate": 3e-4,
        "warmup": 100,
        "tau": 0.005,
        "gamma": 0.99,
        "n_steps": 1,
        "policy_delay": 1,
        "target_entropy": 1.0,
        "actor_average": 0.0,
        "entropy": "auto",
        "layer_norm": False,
    },
    # The authors' released code, its replay buffer cut from 1,000,000 to 300,000.
    "released": {
        "n_envs": 1,
        "steps_per_round": 32,
        "updates_per_round": 32,
        "learning_rate": 1e-4,
        "warmup": 25_000,
        "batch": 512,
        "tau": 0.005,
        "gamma": 0.99,
        "n_steps": 1,
        "policy_delay": 1,
        "target_entropy": 1.0,
        "actor_average": 0.0,
        "entropy": "auto_0.1",
        "actor": (512, 512, 512),
        "critic": (512, 512, 512),
        "layer_norm": False,
        "gsde": True,
        "log_std_init": -2.0,
    },
    "polish": {"zero_init": True, "log_std_init": -2.5, "burn_in": 50_000, "action_penalty": 0.12},
}
"""`dance` is our configuration for tracking: the defaults below. `polish` improves a robot that
dances without a policy already (`track.control.feedback_path: sampled`)."""


def _require_positive(entropy: str) -> str:
    """Return an entropy coefficient that begins above zero."""
    begin = entropy.removeprefix("auto").removeprefix("_")
    if begin and float(begin) == 0:
        raise ValueError(f"{entropy} begins at zero and stays there; take auto or auto_0.02")
    return entropy


NORM_EPSILON = 1e-6
"""Epsilon of layer normalisation: flax's."""

Layers = Annotated[
    tuple[Annotated[int, Field(ge=1, le=4096)], ...], Field(min_length=1, max_length=16)
]

Entropy = Annotated[str, Field(pattern=r"^auto(_\d*\.?\d+)?$"), AfterValidator(_require_positive)]


@dataclass(frozen=True)
class ActorStart:
    """How the actor begins, and what holds it there: fields of `TqcConfig` of the same names, with
    the defaults of a training that is no polish.

    In `TqcConfig` they are null until they are given: a polish fills in what is null alone, and
    leaves a zero or `false` that was set by hand.
    """

    zero_init: bool = False
    log_std_init: float = 0.0
    burn_in: int = 0
    action_penalty: float = 0.0


START = tuple(one.name for one in fields(ActorStart))
"""Names of these fields."""


@config_dataclass
class TqcConfig:
    """TQC and how often it learns.

    Attributes:
        preset: Source of the numbers that are not given.
        n_envs: Simulations stepped together.
        steps_per_round: Policy steps of every simulation between two rounds of updates.
        updates_per_round: Gradient updates a round.
        learning_rate: Step of Adam, for actor, critics and entropy, unitless.
        buffer: Transitions kept for replay, float32.
        warmup: Transitions before the first update, random ones unless the start is pretrained.
        batch: Transitions of a gradient update.
        tau: Share by which the target critics follow an update.
        gamma: Discount of a later reward, factor a policy step.
        n_steps: Rewards that a critic's target adds up before it bootstraps (n-step returns;
            Sutton, 1988), policy steps.
        critics: Critic networks; SBX has two, and so has the reference.
        quantiles: Quantiles of each critic.
        top_quantiles_to_drop: Quantiles of each critic that are dropped, against overestimation.
        entropy: Entropy coefficient: `auto` learns it, `auto_0.02` from that value.
        policy_delay: Critic updates an actor update, so many times in a round; `sb3` knows only 1.
        actor: Units of the actor's hidden layers.
        critic: Units of the critics' hidden layers.
        layer_norm: Layer normalisation between the critics' layers.
        gsde: State-dependent exploration; `sbx` has none and explores with plain noise.
        log_std_init: Logarithm of the first exploration noise; `sb3` uses it with gSDE, or where
            the training starts from a policy, alone. When null 0, or in a polish -2.5.
        zero_init: Begin with actions of zero and noise of `log_std_init`, without random actions
            (residual policy learning, Silver et al., 2018). When null false, or in a polish true.
        burn_in: Transitions before the first update of the actor; the critics learn alone. When
            null 0, or in a polish 50,000.
        action_penalty: Weight of mean squared actions in the actor's loss, multiples of the mean
            absolute value (TD3+BC, Fujimoto and Gu, 2021, about actions of zero), unitless. When
            null 0, or in a polish .12, from an estimated root .03.
        target_entropy: Target entropy of the exploration, multiples of minus the number of actions.
        actor_average: Weight of the past in the running mean of the actor that becomes the
            policy, a round of updates; 0 is the last actor.
    """

    preset: Literal["dance", "paper", "released", "polish"] = "dance"
    n_envs: int = Field(default=32, ge=1, le=4096)
    steps_per_round: int = Field(default=8, ge=1, le=10_000)
    updates_per_round: int = Field(default=24, ge=1, le=10_000)
    learning_rate: float = Field(default=5e-4, gt=0, lt=1)
    buffer: int = Field(default=300_000, ge=1_000, le=1_000_000)
    warmup: int = Field(default=2_000, ge=1)
    batch: int = Field(default=256, ge=1, le=65_536)
    tau: float = Field(default=0.01, gt=0, le=1)
    gamma: float = Field(default=0.985, gt=0, lt=1)
    n_steps: int = Field(default=3, ge=1, le=100)
    policy_delay: int = Field(default=2, ge=1)
    critics: Literal[2] = 2
    quantiles: int = Field(default=25, ge=1, le=1_000)
    top_quantiles_to_drop: int = Field(default=2, ge=0)
    entropy: Entropy = "auto_0.02"
    actor: Layers = (256, 256)
    critic: Layers = (256, 256)
    layer_norm: bool = True
    gsde: bool = False
    log_std_init: float | None = None
    zero_init: bool | None = None
    burn_in: int | None = Field(default=None, ge=0)
    action_penalty: float | None = Field(default=None, ge=0)
    target_entropy: float = Field(default=1.5, gt=0)
    actor_average: float = Field(default=0.98, ge=0, lt=1)

    @model_validator(mode="before")
    @classmethod
    def _preset(cls, given: Any) -> Any:
        if isinstance(given, Mapping):  # null is not given, as in a file that was written whole
            given = {k: v for k, v in given.items() if k not in START or v is not None}
        return with_preset(given, PRESETS, "dance")

    @model_validator(mode="after")
    def _learns(self) -> "TqcConfig":
        """Raise for numbers with which a training would finish without learning."""
        if self.top_quantiles_to_drop >= self.quantiles:
            raise ConflictingValues(
                f"top_quantiles_to_drop, {self.top_quantiles_to_drop}, must leave some of the "
                f"{self.quantiles} quantiles",
                "top_quantiles_to_drop",
                "quantiles",
            )
        rows = max(self.buffer // self.n_envs, 1)
        if self.n_steps >= rows:
            raise ConflictingValues(
                f"n_steps, {self.n_steps}, needs more than the {rows} transitions of a simulation "
                f"for which the replay buffer has room ({self.buffer} on {self.n_envs} "
                "simulations): raise buffer or lower n_steps",
                "n_steps",
                "buffer",
                "n_envs",
            )
        room = rows * self.n_envs
        if self.warmup > room:
            raise ConflictingValues(
                f"the replay buffer has room for {room} transitions ({self.buffer} on "
                f"{self.n_envs} simulations), and learning would begin after {self.warmup}: "
                "raise buffer or lower warmup",
                "buffer",
                "n_envs",
                "warmup",
            )
        return self

    @property
    def actor_start(self) -> ActorStart:
        """Return how the actor begins, with the default for what is null."""
        given = {name: getattr(self, name) for name in START}
        return ActorStart(**{name: value for name, value in given.items() if value is not None})
