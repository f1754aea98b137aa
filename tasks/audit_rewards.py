"""Audit what the rewards of a study pay to bodies that do not dance."""

import json

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import PaperConfig, TrackConfig
from robojackson.robot.model import RobotDescription, load_robot
from storage import artifact_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.robot_digests import robot_models
from tasks.runtime.stage import stage


@stage(models=robot_models)
def audit_rewards(
    reference: Artifact, robot: RobotDescription, rewards: dict[str, TrackConfig | PaperConfig]
) -> Artifact:
    """Return, by name of the reward, the share of a perfect dance that each body earns (JSON)."""
    from robojackson.rl.evaluation.reward_audit import audit_reward

    store = Store.from_environment()
    motion, machine = artifact_tables.read(ReferenceMotion, store, reference), load_robot(robot)
    paid = {name: audit_reward(machine, motion, reward).of for name, reward in rewards.items()}
    return store.save("audit_rewards", "reward_audits.json", json.dumps(paid, indent=1).encode())
