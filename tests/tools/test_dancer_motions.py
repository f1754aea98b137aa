"""The motions that the dancer learns: converted, and none that are held out."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.learning.split import load_split
from robojackson.body.skeleton import keypoint
from tests.fixtures.robots import robot_motion
from tools.dancer.library import sequences
from tools.dancer.pack import collection
from tools.dancer.smpl_motion import smpl_sequence
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


def test_the_dancer_trains_on_no_motion_that_evaluates_it(tmp_path: Path) -> None:
    for name in load_split().held_out:
        (tmp_path / f"{name.removeprefix('cmu_')}.bvh.gz").touch()
    assert [name for name, *_ in sequences(tmp_path, 0)] == []
    robot_motion("dance_b").save(tmp_path / "dance_b.parquet")
    with pytest.raises(ValueError, match="not for training: dance_b"):
        collection(tmp_path)


@pytest.mark.parametrize("name", ["long_walk1_0", "cmu_05_07", "cmu_05_09_slow", "unheard_of"])
def test_the_dancer_s_pack_takes_captured_motions_of_the_training_list_alone(
    name: str, tmp_path: Path
) -> None:
    for trainable in (
        "jog_0",
        "stealthy_walk1_1",
        "cmu_05_01",
        "cmu_05_01_slow",
        "invented_007",
    ):
        robot_motion("hip_shake").save(tmp_path / f"{trainable}.parquet")
    assert len(collection(tmp_path)) == 5
    robot_motion("hip_shake").save(tmp_path / f"{name}.parquet")
    with pytest.raises(ValueError, match="not for training: "):
        collection(tmp_path)


def test_a_walk_that_contains_the_evaluated_walk_is_passed_over(tmp_path: Path) -> None:
    for name in load_split().excluded:
        (tmp_path / f"humanoid3d_{name}.txt.gz").touch()
    assert [name for name, *_ in sequences(tmp_path, 0)] == []
