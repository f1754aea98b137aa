"""What a study trains, read and checked before Prefect is imported."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from configs.study_config import Move, Study
from robojackson.errors import UnreadableVideo
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.config.train_config import TrainConfig
from robojackson.robot.model import load_robot


def study_of(name: str, overrides: Mapping[str, Any]) -> Study:
    """A study of `configs/studies` or of a path, with everything that it names.

    Raises:
        UnknownName, BadConfiguration: something that it names does not exist or cannot be used.
        UnreadableVideo: the clip of a move is not there.
    """
    study = load(Study, f"studies/{name}" if "." not in name else name, overrides)
    robot = describe_robot(study.robot)
    load_robot(robot)
    for move in study.moves:
        require_move(move, study.pipeline)
    for setup in study.setups:
        training(study, setup)
    return replace(study, robot=robot.file or study.robot)


def training(study: Study, setup: str) -> TrainConfig:
    """How the cells of a setup are trained; seeds come later."""
    given = {"mode": study.mode, "steps": study.steps, "trainer": study.trainer, **study.train}
    return load(TrainConfig, f"setups/{setup}", given)


def require_move(name: str, pipeline: str) -> None:
    """Refuse a move whose clip or configuration cannot be used."""
    move = load(Move, f"moves/{name}")
    load(PipelineConfig, pipeline, move.overrides)
    if not move.path.is_file():
        raise UnreadableVideo(f"{move.path}: no such file (configs/moves/{name}.yaml: clip)")
