"""The training that the options of a command request."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from robojackson.errors import BadConfiguration
from robojackson.pipeline.yaml_loader import load

if TYPE_CHECKING:
    from robojackson.rl.config.train_config import TrainConfig

SECTION = "train."
"""Section of a pipeline's configuration with a training's keys."""


@dataclass(frozen=True)
class Requested:
    """The request of a command for a training.

    Attributes:
        train: The training's configuration.
        setup: Name or file for the tables; None derives a name from the settings.
        gate: Whether a motion that the robot cannot follow is refused.
    """

    train: "TrainConfig"
    setup: str | None
    gate: bool = True


def without_section(overrides: Mapping[str, object]) -> dict[str, object]:
    """Return the overrides of a training that may be named as in a configuration of a pass,
    `train.seed`, as a setup names them."""
    return {key.removeprefix(SECTION): value for key, value in overrides.items()}


def requested(config: str | None, setup: str | None, overrides: Mapping[str, object]) -> Requested:
    """Return the training that files, `--set` and options request; later ones override earlier
    ones.

    Raises:
        UnknownName: no such file.
        BadConfiguration: a wrong key or value; a setup beside a configuration.
    """
    from robojackson.api.policy_training import setup_file
    from robojackson.pipeline.pipeline_config import PipelineConfig
    from robojackson.rl.config.train_config import TrainConfig

    if config is None:
        own = without_section(overrides)
        return Requested(load(TrainConfig, setup_file(setup), own), setup)
    if setup is not None:
        raise BadConfiguration(
            f"--config {config} and --setup {setup}: give one; a configuration has a "
            "setup's keys in its section `train`"
        )
    given = {f"{SECTION}{key.removeprefix(SECTION)}": value for key, value in overrides.items()}
    whole = load(PipelineConfig, config, given)
    return Requested(whole.train, None, whole.gate)


def robust(
    reference: Path,
    robot: str | None,
    config: str | None,
    setup: str | None,
    given: Mapping[str, object],
) -> dict[str, object]:
    """Return the overrides of `train --robust`, for `robot` or that of the motion."""
    from robojackson.api.arguments import description_of
    from robojackson.motion.reference_motion import ReferenceMotion
    from robojackson.pipeline.robot_descriptions import describe_robot
    from robojackson.pipeline.robust_training import robust_training, with_defaults

    motion = ReferenceMotion.load(reference)
    description = describe_robot(robot) if robot else description_of(motion)
    train = requested(config, setup, given).train
    return with_defaults(robust_training(train, description), without_section(given))
