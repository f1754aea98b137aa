"""The settings of `--robust`: a training with varied physics, and a pass with its passport."""

from collections.abc import Mapping

from robojackson.config import leaves
from robojackson.errors import BadConfiguration
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.yaml_loader import load, parsed_overrides
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.evaluation.passport import robust_ranges
from robojackson.rl.modes.track_mode import is_fed
from robojackson.robot.description import RobotDescription


def robust_dance(config: str, given: Mapping[str, object]) -> dict[str, object]:
    """Return the overrides of a robust pass, recorded as the setup `robust`; those that were given
    win.

    Args:
        config: Name or path of the pipeline's configuration, which names the robot.
        given: Overrides by key path, as train.seed, or whole sections.

    Raises:
        BadConfiguration: `instant` or the mode `paper`; a wrong key or value.
        UnknownName: no such robot or configuration.
    """
    settings = load(PipelineConfig, config, given)
    if settings.instant:
        raise BadConfiguration("instant=true trains nothing: leave out instant, or robust")
    found = robust_training(settings.train, describe_robot(settings.robot))
    trained = {f"train.{key}": value for key, value in found.items()}
    return with_defaults({**trained, "setup": "robust", "evaluate.passport": True}, given)


def robust_training(config: TrainConfig, description: RobotDescription) -> dict[str, object]:
    """Return what `--robust` adds to a training's configuration: the ranges that it draws from.

    On top of feedback a robot observes what it measures itself, unless the training starts from
    other networks or has another observation: noise of a root that the feedback takes for exact
    costs it more than the estimate (docs/learning_g1.md, "Robust").

    Raises:
        BadConfiguration: the mode `paper`, whose physics does not vary.
    """
    if config.mode == "paper":
        raise BadConfiguration("mode=paper has no varied physics: use mode track, or not robust")
    track = config.track
    fed = is_fed(config, description) and track.control.root_state != "exact"
    usual = track.observation == "full" and config.start == "scratch"
    ranges: dict[str, object] = robust_ranges()
    return ranges | ({"track.observation": "onboard"} if fed and usual else {})


def with_defaults(added: Mapping[str, object], given: Mapping[str, object]) -> dict[str, object]:
    """Return overrides with what is added to the given ones unless they say otherwise. Text is read
    as YAML."""
    said = {key for key, _ in leaves(parsed_overrides(given))}
    return {key: value for key, value in added.items() if key not in said} | dict(given)
