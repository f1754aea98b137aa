"""Retarget the motion of a person to the reference motion of a robot."""

from robojackson.files.json_types import to_json
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.retarget.retargeting import RetargetConfig
from robojackson.retarget.retargeting import retarget_motion as to_robot
from robojackson.retarget.scorecard_gate import scorecard_record
from robojackson.robot.model import RobotDescription, load_robot
from storage import artifact_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.robot_digests import robot_models
from tasks.runtime.stage import stage


@stage(models=robot_models)
def retarget_motion(
    sequence: Artifact, robot: RobotDescription, config: RetargetConfig
) -> dict[str, Artifact]:
    """Return `reference` (ReferenceMotion) and `scorecard` (its figures, JSON)."""
    store = Store.from_environment()
    motion = artifact_tables.read(SmplSequence, store, sequence)
    reference = to_robot(motion, load_robot(robot), config)
    scorecard = to_json(scorecard_record(reference))
    return {
        "reference": artifact_tables.save(store, "retarget", "reference.parquet", reference),
        "scorecard": store.save("retarget", "scorecard.json", scorecard),
    }
