"""Configuration of an ablation: moves x setups x seeds.

One experiment is one `Study`; `configs/studies/*.yaml` are those that ship, and the parameters of
the deployments `ablation/paper` and `ablation/smoke` are the same text.
"""

from dataclasses import field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from robojackson.config import config_dataclass
from robojackson.pipeline.app_folder import app_folder

OF_THE_STUDY = (
    "robot",
    "setup",
    "minutes",
    "gate",
    "train",
    "evaluate",
    "render",
)
"""Keys of the pipeline's configuration that are no part of a motion."""
Setup = Literal["scratch", "pretrain", "curiosity", "scratch-curiosity", "pretrained-dancer"]
Executor = Literal["local", "work-pool"]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][\w.-]*$", max_length=60)]
Seed = Annotated[int, Field(ge=0)]
Steps = Annotated[int, Field(ge=1)]


def _each_once(values: tuple[Any, ...]) -> tuple[Any, ...]:
    """Refuse duplicates: twins would be one cell, which two runs train at once."""
    twice = sorted({value for value in values if values.count(value) > 1})
    if twice:
        listed = ", ".join(map(str, twice))
        raise PydanticCustomError("twice", "{values} is listed twice", {"values": listed})
    return values


Distinct = AfterValidator(_each_once)


@config_dataclass
class Move:
    """A dance that robots are taught.

    Attributes:
        clip: Path of its video, from the working directory or from where `clips` is.
        paper: What the paper calls it, if it stands for a move of the paper.
        walking: Whether it is walking rather than dancing (the paper's third claim).
        overrides: Values of the pipeline's configuration by key path, of what makes its motion.
    """

    clip: str
    paper: str = ""
    walking: bool = False
    overrides: dict[str, Any] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _of_the_motion(self) -> "Move":
        """Refuse keys that the study sets for all of its moves, or that nothing reads."""
        for key in self.overrides:
            if key.partition(".")[0] in OF_THE_STUDY:
                raise ValueError(f"overrides.{key}: is no part of a motion; set it in the study")
        return self

    @property
    def path(self) -> Path:
        """The video: a path that exists, or one of the bundled clips."""
        given = Path(self.clip)
        return given if given.is_file() else app_folder() / given


@config_dataclass
class Study:
    """One ablation. The last four fields, how its cells are run, are no part of its identity.

    Attributes:
        name: Name of the study, in the tables and on the page.
        moves: Names of `configs/moves/*.yaml`.
        setups: Names of `configs/setups/*.yaml`.
        seeds: Seeds of the trainings; a seed is the same for all setups, so that they are paired.
        mode: `paper`: its reward, observation and torques; `track`: the method that dances.
        steps: Control steps of each training. No clock ends one: the tables are repeatable.
        move_steps: Move -> control steps of its trainings, where they are not `steps`.
        trainer: `sbx` (JAX, fast) or `sb3` (the reference).
        robot: Name of `configs/robots/*.yaml`, or path, where the worker is, of your own YAML.
        pipeline: Name of the configuration that makes the reference motions and evaluates.
        gate: Refuse the study when a motion breaks a hard bar of its score card, as `dance` does;
            off: train on it anyway, and log it.
        train: Values of the training's configuration by key path, for all cells.
        executor: `local`: processes of this machine; `work-pool`: runs that workers take.
        slots: Trainings at once on this machine; the number of its cores if absent.
        timeout_minutes: Wall time after which a cell has failed, minutes: training, evaluation and
            what is tried again of them, all together; waiting for a worker is no part of it.
        retries: How often a cell whose process was killed is started again.
    """

    name: Name = "paper"
    moves: Annotated[tuple[Name, ...], Field(min_length=1), Distinct] = (
        "hip_shake",
        "dance_b",
        "walk",
    )
    setups: Annotated[tuple[Setup, ...], Field(min_length=1), Distinct] = (
        "scratch",
        "pretrain",
        "curiosity",
    )
    seeds: Annotated[tuple[Seed, ...], Field(min_length=1), Distinct] = (0, 1, 2)
    mode: Literal["paper", "track"] = "paper"
    steps: Steps = 50_000
    move_steps: dict[Name, Steps] = Field(default_factory=dict)
    trainer: Literal["sbx", "sb3"] = "sbx"
    robot: str = field(default="humanoid", compare=False)
    pipeline: str = "base"
    gate: bool = True
    train: dict[str, Any] = Field(default_factory=dict)
    executor: Executor = field(default="local", compare=False)
    slots: Annotated[int, Field(ge=1)] | None = field(default=None, compare=False)
    timeout_minutes: Annotated[float, Field(gt=0)] = field(default=240.0, compare=False)
    retries: Annotated[int, Field(ge=0)] = field(default=2, compare=False)

    @property
    def steps_label(self) -> str:
        """Return the control steps of each training as text, move by move where they differ."""
        by_move = {move: self.steps_of(move) for move in self.moves}
        if len(set(by_move.values())) == 1:
            return f"{by_move[self.moves[0]]:,}"
        return ", ".join(f"{move} {steps:,}" for move, steps in by_move.items())

    def steps_of(self, move: str) -> int:
        """Return the control steps of each training on a move."""
        return self.move_steps.get(move, self.steps)
