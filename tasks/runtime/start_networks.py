"""The networks that a training starts from, on this machine."""

from pathlib import Path

from robojackson.files.local_folder import LocalFolder
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.pretrained import start_file
from robojackson.rl.walkers import keep_walker, walker_key
from robojackson.robot.description import RobotDescription
from storage.store import Store

WALKER = "walker"


def local_start_file(store: Store, config: TrainConfig, robot: RobotDescription) -> Path | None:
    """Return the file of the networks that a training starts from, None for `scratch`; a walker in
    a store that is no folder is copied here first.

    Raises:
        BadPolicy: there are no such networks, or no walker for this robot.
        BadConfiguration: the model of the robot is not here.
    """
    if config.start == WALKER and not isinstance(store.place, LocalFolder):
        key = walker_key(robot, config.mode)
        if store.exists(key):
            keep_walker(robot, config.mode, store.read(key))
    return start_file(config.start, config.mode, robot)
