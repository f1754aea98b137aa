"""What the rewards of a study pay to bodies that do not dance."""

import json

from robojackson.motion.reference import ReferenceMotion
from robojackson.retarget.robot import RobotDescription, load_robot
from robojackson.rl.config import PaperConfig, TrackConfig
from storage import tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.caching import stage
from tasks.robots import robot_models


@stage(models=robot_models)
def payments(
    reference: Artifact, robot: RobotDescription, rewards: dict[str, TrackConfig | PaperConfig]
) -> Artifact:
    """JSON: by name of the reward, the share of a perfect dance that each body earns."""
    from robojackson.rl.shares import shares

    store = Store.from_environment()
    motion, machine = tables.read(ReferenceMotion, store, reference), load_robot(robot)
    paid = {name: shares(machine, motion, reward).of for name, reward in rewards.items()}
    return store.keep("payments", "payments.json", json.dumps(paid, indent=1).encode())
