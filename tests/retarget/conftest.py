"""The stock robot, and two short human motions kept as they left our own mocap stage."""

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from configs.loader import load
from robojackson.motion.reference import ReferenceMotion
from robojackson.motion.smpl import SmplSequence
from robojackson.retarget import RetargetConfig, Robot, RobotDescription, load_robot, retarget

GOLDEN = Path(__file__).parent.parent / "golden"


@lru_cache
def description(name: str = "humanoid") -> RobotDescription:
    """A shipped robot description."""
    return load(RobotDescription, f"robots/{name}")


@lru_cache
def stock() -> Robot:
    """Humanoid-v5."""
    return load_robot(description())


@lru_cache
def human(clip: str) -> SmplSequence:
    """A motion of `tests/golden/retarget_<clip>.npz` (our mocap of the bundled clip)."""
    with np.load(GOLDEN / f"retarget_{clip}.npz") as data:
        keypoints = data["keypoints_w"].astype(float)
        frames = len(keypoints)
        return SmplSequence(
            fps=float(data["fps"]),
            global_orient=data["global_orient"].astype(float),
            body_pose=data["body_pose"].astype(float),
            transl=keypoints[:, 0],
            joints=keypoints[:, :24],
            keypoints_w=keypoints,
            confidence=np.ones((frames, 29)),
            contact=data["contact"].astype(int),
            valid=np.ones(frames, bool),
            betas=np.zeros(10),
            rest_joints=np.zeros((29, 3)),
        )


@lru_cache
def robot_motion(clip: str, method: str = "optimise", cyclic: str = "auto") -> ReferenceMotion:
    """A golden motion on the stock robot."""
    return retarget(human(clip), stock(), RetargetConfig(method=method, cyclic=cyclic))  # type: ignore[arg-type]


@pytest.fixture
def robot() -> Robot:
    """Humanoid-v5."""
    return stock()


@pytest.fixture
def rng() -> np.random.Generator:
    """Seeded."""
    return np.random.default_rng(7)


@pytest.fixture
def poses(robot: Robot, rng: np.random.Generator) -> np.ndarray:
    """Thirty poses all over the joint ranges, roots anywhere."""
    qpos = np.tile(robot.standing, (30, 1))
    qpos[:, :3] += rng.normal(size=(30, 3))
    quat = rng.normal(size=(30, 4))
    qpos[:, 3:7] = quat / np.linalg.norm(quat, axis=1, keepdims=True)
    qpos[:, 7:] = rng.uniform(robot.lower, robot.upper, (30, len(robot.lower)))
    return qpos
