"""The motions that the dancer learns: converted, mirrored, and none that are held out."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.learning.split import load_split
from robojackson.body.skeleton import keypoint
from robojackson.motion.reference_motion import ReferenceMotion
from tests.fixtures.robots import robot_motion, stock
from tools.dancer.library import sequences
from tools.dancer.mirror import mirrored
from tools.dancer.smpl_motion import smpl_sequence
from tools.dancer.train import collection
from tools.render import deepmimic

STILL = {name: Rotation.identity(12) for name in ("root", *deepmimic.TREE_ORDER)}
AT = np.tile([0.3, 0.9, -0.2], (12, 1))


def posed(**turns: Rotation) -> np.ndarray:
    """Return the keypoints of a motionless person, some of whose parts are turned, relative to the
    pelvis."""
    turned = {name: Rotation.concatenate([turn] * 12) for name, turn in turns.items()}
    points = smpl_sequence(deepmimic.Motion(30.0, AT, STILL | turned)).keypoints_w[5]
    return np.asarray(points - points[keypoint("pelvis")])


def test_arms_hang_beside_the_body() -> None:
    points = posed()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        shoulder, wrist = (points[keypoint(f"{side}_{part}")] for part in ("shoulder", "wrist"))
        assert wrist[2] < shoulder[2] - 0.4
        assert abs(wrist[1] - shoulder[1]) < 0.05
        assert sign * shoulder[1] > 0.1
    assert points[keypoint("left_big_toe")][0] > 0.05, "the feet do not point forward"


def test_an_arm_that_swings_forward_points_forward() -> None:
    forward = Rotation.from_euler("z", 90, degrees=True)
    points = posed(left_shoulder=forward, left_elbow=forward)
    reach = points[keypoint("left_wrist")] - points[keypoint("left_shoulder")]
    assert reach[0] > 0.4
    assert np.abs(reach[1:]).max() < 0.06


def test_a_mirrored_motion_is_one_of_the_same_robot() -> None:
    robot, motion = stock(), robot_motion("dance_b")
    image, data = mirrored(motion, robot), mujoco.MjData(stock().model)
    for step in range(0, len(image), 20):
        data.qpos[:] = image.qpos[step]
        mujoco.mj_kinematics(robot.model, data)
        np.testing.assert_allclose(
            data.site_xpos[robot.keypoint_sites], image.keypoints_w[step], atol=2e-3
        )
    np.testing.assert_allclose(mirrored(image, robot).qpos, motion.qpos, atol=1e-12)


def test_speeds_are_mirrored_with_the_places() -> None:
    robot, motion = stock(), robot_motion("dance_b")
    image = mirrored(motion, robot)
    np.testing.assert_allclose(
        np.diff(image.qpos[:, 7:], axis=0)[10:-10] / motion.dt,
        image.qvel[10:-11, 6:],
        atol=1.5,
    )
    np.testing.assert_allclose(image.qvel[:, 5], -motion.qvel[:, 5])


def test_the_dancer_trains_on_no_motion_that_evaluates_it(tmp_path: Path) -> None:
    for name in load_split().held_out:
        (tmp_path / f"{name.removeprefix('cmu_')}.bvh.gz").touch()
    assert [name for name, *_ in sequences(tmp_path, 0)] == []
    motion: ReferenceMotion = robot_motion("dance_b")
    motion.save(tmp_path / "dance_b.parquet")
    with pytest.raises(ValueError, match="not for training: dance_b"):
        collection(tmp_path, stock())
