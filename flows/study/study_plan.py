"""Plan of a study, read and checked before Prefect is imported."""

import logging
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from configs.study_config import Move, Study
from robojackson.cli.options import yaml_text
from robojackson.errors import UnreadableVideo
from robojackson.pipeline.configuration_files import SUFFIXES
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.yaml_loader import load, own_values
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.walkers import STARTS
from robojackson.robot.description import RobotDescription
from robojackson.robot.model import load_robot
from storage.store import Store
from tasks.runtime.start_networks import local_start_file

log = logging.getLogger(__name__)


def study_of(name: str, overrides: Mapping[str, Any]) -> Study:
    """Return a study of `configs/studies` or of a path, with everything that it names; one whose
    file has no name of its own is called as the file.

    Raises:
        UnknownName, BadConfiguration: something that it names does not exist or cannot be used.
        BadPolicy: a setup starts from a walker or the dancer and the robot has none.
        UnreadableVideo: the clip of a move is not there.
    """
    if overrides.get("steps") is not None:
        overrides = {"move_steps": {}, **overrides}  # of all moves
    file = f"studies/{name}" if Path(name).suffix not in SUFFIXES else name
    if overrides.get("name") is None:
        overrides = {**overrides, "name": yaml_text(_name_of(file))}
    study = load(Study, file, overrides)
    robot = describe_robot(study.robot)
    load_robot(robot)
    for move in {*study.moves, *study.move_steps}:
        require_move(move, study.pipeline)
    trainings_of(study, robot)
    return replace(study, robot=robot.file or study.robot)


def _name_of(file: str) -> str:
    """Return the name of a study by its file; a copy that keeps the name of another study would
    replace the cells and the page of that one."""
    path = Path(file)
    stem = path.stem if path.suffix in SUFFIXES else path.name
    own = str(own_values(file).get("name", stem))
    if own != stem:
        log.warning("%s: the name of the study is %s, whose cells and page it replaces", file, own)
    return own


def trainings_of(study: Study, robot: RobotDescription) -> dict[str, TrainConfig]:
    """Return how the cells of each setup are trained; all of them can begin.

    Raises:
        UnknownName, BadConfiguration: a setup does not exist, or the model of the robot is missing.
        BadPolicy: a setup starts from a walker or the dancer and the robot has none.
    """
    found: dict[str, TrainConfig] = {s: training(study, s) for s in study.setups}
    for config in found.values():
        if config.start in STARTS:
            local_start_file(Store.from_environment(), config, robot)
    return found


def training(study: Study, setup: str) -> TrainConfig:
    """Return how the cells of a setup are trained; seeds come later."""
    given = {"mode": study.mode, "steps": study.steps, "trainer": study.trainer, **study.train}
    return load(TrainConfig, f"setups/{setup}", given)


def require_move(name: str, pipeline: str) -> None:
    """Refuse a move whose clip or configuration cannot be used."""
    move = load(Move, f"moves/{name}")
    load(PipelineConfig, pipeline, move.overrides)
    if not move.path.is_file():
        raise UnreadableVideo(f"{move.path}: no such file (configs/moves/{name}.yaml: clip)")
