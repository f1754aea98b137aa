"""Laws of the training pairs: which motions may be used, and that what is invented is a person."""

import json
from pathlib import Path

import numpy as np
import pytest

from tools.pairs import cmu_bvh, gestures, sources
from tools.render import deepmimic

BVH = """HIERARCHY
ROOT Hips
{{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
{joints}}}
MOTION
Frames: 2
Frame Time: 0.0333333
{rows}
"""
CHAINS = (
    ("LeftUpLeg", (1, -1, 0), "LeftLeg", (0, -7, 0), "LeftFoot", (0, -7, 0)),
    ("RightUpLeg", (-1, -1, 0), "RightLeg", (0, -7, 0), "RightFoot", (0, -7, 0)),
    ("Spine1", (0, 4, 0), "Head", (0, 4, 0), "Top", (0, 1, 0)),
    ("LeftArm", (3, 4, 0), "LeftForeArm", (5, 0, 0), "LeftHand", (4, 0, 0)),
    ("RightArm", (-3, 4, 0), "RightForeArm", (-5, 0, 0), "RightHand", (-4, 0, 0)),
)


@pytest.fixture
def t_pose(tmp_path: Path) -> Path:
    text = ""
    for chain in CHAINS:
        for name, offset in zip(chain[::2], chain[1::2], strict=True):
            place = " ".join(str(x) for x in offset)
            text += f"JOINT {name}\n{{\nOFFSET {place}\n"
            text += "CHANNELS 3 Zrotation Yrotation Xrotation\n"
        text += "}\n" * 3
    zeros = " ".join(["0"] * (6 + 3 * 15))
    path = tmp_path / "01_01.bvh"
    path.write_text(BVH.format(joints=text, rows=f"{zeros}\n{zeros}"))
    return path


@pytest.mark.parametrize("name", sources.REPORTED)
def test_a_motion_that_is_reported_on_may_not_be_trained_on(name: str, tmp_path: Path) -> None:
    with pytest.raises(sources.RefusedMotion, match="reported"):
        sources.read(tmp_path / f"humanoid3d_{name}.txt", 30.0)


def test_an_unknown_motion_may_not_be_trained_on(tmp_path: Path) -> None:
    with pytest.raises(sources.RefusedMotion, match="not a training motion"):
        sources.check_allowed(tmp_path / "my_dance.txt")


def test_no_motion_is_both_allowed_and_reported() -> None:
    assert not set(sources.ALLOWED) & set(sources.REPORTED)


def test_reported_motions_in_a_folder_are_passed_over(tmp_path: Path) -> None:
    for name in ("humanoid3d_dance_a.txt", "humanoid3d_jump.txt", "humanoid3d_walk.txt"):
        (tmp_path / name).write_text(json.dumps({"Frames": []}))
    assert [path.name for path in sources.find([tmp_path])] == ["humanoid3d_jump.txt"]


def test_the_mirror_of_a_mirror_is_the_motion() -> None:
    motion = gestures.invent(np.random.default_rng(1), 40, 30.0)
    twice = sources.mirrored(sources.mirrored(motion))
    off = [(motion.rotations[n].inv() * twice.rotations[n]).magnitude() for n in motion.rotations]
    assert np.max(off) < 1e-9


def test_a_bvh_in_t_pose_has_arms_out_and_legs_down(t_pose: Path) -> None:
    motion = cmu_bvh.read(t_pose)
    assert len(motion) == 1  # the first of two frames is CMU's own pose before the motion
    limbs = {
        name: motion.rotations[name].apply(gestures.DOWN)[0]
        for name in ("left_shoulder", "right_elbow", "left_hip", "right_knee")
    }
    assert np.allclose(limbs["left_shoulder"], [0.0, 0.0, -1.0], atol=1e-9)
    assert np.allclose(limbs["right_elbow"], [0.0, 0.0, 1.0], atol=1e-9)
    assert np.allclose(limbs["left_hip"], gestures.DOWN, atol=1e-9)
    assert np.allclose(limbs["right_knee"], gestures.DOWN, atol=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_invented_knees_and_elbows_bend_one_way(seed: int) -> None:
    motion = gestures.invent(np.random.default_rng(seed), 60, 30.0)
    for joint, (parent, _) in deepmimic.HINGES.items():
        turn = (motion.rotations[parent].inv() * motion.rotations[joint]).as_rotvec()
        sign = 1.0 if joint.endswith("elbow") else -1.0
        assert np.abs(turn[:, :2]).max() < 1e-6
        assert (sign * turn[:, 2]).min() > -1e-6


@pytest.mark.parametrize("seed", range(6))
def test_invented_limbs_do_not_jump(seed: int) -> None:
    motion = gestures.invent(np.random.default_rng(seed), 90, 30.0)
    for name in ("left_shoulder", "right_hip", "chest"):
        rotation = motion.rotations[name]
        steps = (rotation[:-1].inv() * rotation[1:]).magnitude()
        assert np.degrees(np.median(steps)) < 20.0


def test_the_same_seed_invents_the_same_dance() -> None:
    one, other = (gestures.invent(np.random.default_rng(3), 30, 30.0) for _ in range(2))
    assert np.array_equal(one.root_position, other.root_position)
