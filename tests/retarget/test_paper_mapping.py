"""Table I of the paper, literally: components of SMPL rotation vectors become hinge angles."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.body.skeleton import JOINT_NAMES
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.retarget.paper_mapping import mapped
from robojackson.robot.model import Robot
from tests.fixtures.robots import human


def _bent(joint: str, rotvec: list[float]) -> SmplSequence:
    """Return the hip shake's first frame, held, with one SMPL joint turned."""
    source = human("hip_shake")
    pose = np.zeros((40, 23, 3))
    pose[:, JOINT_NAMES.index(joint) - 1] = rotvec
    return replace(
        source,
        body_pose=pose.reshape(40, 69),
        global_orient=np.zeros((40, 3)),
        keypoints_w=np.repeat(source.keypoints_w[:1], 40, axis=0),
    )


def _hinges(robot: Robot, sequence: SmplSequence, corrected: bool) -> dict[str, float]:
    qpos = mapped(sequence, robot, np.arange(60) * 0.015, corrected)
    return dict(zip(robot.joint_names, qpos[30, 7:], strict=True))


@pytest.mark.parametrize(
    ("joint", "component", "hinge"),
    [
        ("left_hip", 0, "left_hip_x"),
        ("left_hip", 1, "left_hip_y"),
        ("right_hip", 2, "right_hip_z"),
        ("right_knee", 0, "right_knee"),
        ("left_shoulder", 0, "left_shoulder1"),
        ("left_shoulder", 1, "left_shoulder2"),
        ("right_elbow", 1, "right_elbow"),
    ],
)
def test_a_component_is_copied_to_its_hinge(robot: Robot, joint, component, hinge):
    rotvec = [0.0, 0.0, 0.0]
    rotvec[component] = 0.3
    hinges = _hinges(robot, _bent(joint, rotvec), corrected=False)
    assert hinges.pop(hinge) == pytest.approx(0.3)
    np.testing.assert_allclose(list(hinges.values()), 0.0, atol=1e-12)


def test_literally_a_bent_knee_is_beyond_its_limit_and_corrected_it_bends(robot: Robot):
    knee = _bent("left_knee", [1.0, 0.0, 0.0])
    upper = dict(zip(robot.joint_names, robot.upper, strict=True))["left_knee"]
    assert _hinges(robot, knee, corrected=False)["left_knee"] > upper
    assert _hinges(robot, knee, corrected=True)["left_knee"] == pytest.approx(-1.0)


def test_the_corrected_mapping_stays_inside_the_limits(robot: Robot):
    qpos = mapped(human("walk"), robot, np.arange(150) * 0.015, corrected=True)
    assert (qpos[:, 7:] >= robot.lower).all()
    assert (qpos[:, 7:] <= robot.upper).all()
