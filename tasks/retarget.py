"""From the motion of a person to the reference motion of a robot."""

import json

from robojackson.motion.smpl import SmplSequence
from robojackson.retarget.motion import RetargetConfig
from robojackson.retarget.motion import retarget as to_robot
from robojackson.retarget.robot import RobotDescription, load_robot
from robojackson.retarget.scorecard import told
from storage import tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.caching import stage
from tasks.robots import robot_models


@stage(models=robot_models)
def retarget(
    sequence: Artifact, robot: RobotDescription, config: RetargetConfig
) -> dict[str, Artifact]:
    """`reference`: ReferenceMotion; `scorecard`: its figures, as JSON."""
    store = Store.from_environment()
    motion = tables.read(SmplSequence, store, sequence)
    reference = to_robot(motion, load_robot(robot), config)
    scorecard = json.dumps(told(reference), indent=1).encode()
    return {
        "reference": tables.keep(store, "retarget", "reference.parquet", reference),
        "scorecard": store.keep("retarget", "scorecard.json", scorecard),
    }
