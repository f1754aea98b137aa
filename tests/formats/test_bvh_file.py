"""BVH: an independent reader sees the same joints; skeletons of others are understood."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pybvh
import pytest
from scipy.spatial.transform import Rotation

from robojackson.body.skeleton import JOINT_NAMES, REST_JOINTS, REST_OFFSETS, keypoint
from robojackson.errors import BadTable
from robojackson.formats import bvh
from robojackson.formats.containers import bvh_tree
from robojackson.formats.containers.bvh_names import keypoints_of
from robojackson.formats.foreign_motion import Y_UP_TO_WORLD
from robojackson.mocap.imported_motion import ground_foreign_motion
from tests.fixtures.person import person

CENTIMETRE = 0.01


def test_an_independent_reader_sees_the_same_joints(tmp_path: Path) -> None:
    sequence = person()
    path = tmp_path / "motion.bvh"
    path.write_bytes(bvh.write(sequence))
    other = pybvh.read_bvh_file(path)
    names = [node.name for node in other.nodes]
    places = other.node_positions()[:, [names.index(name) for name in JOINT_NAMES]] * CENTIMETRE
    in_our_world = places[..., [2, 0, 1]]
    np.testing.assert_allclose(in_our_world, sequence.joints, atol=1e-5)
    assert other.fps == pytest.approx(sequence.fps, abs=1e-3)


def test_no_joint_turns_the_long_way_round_between_two_frames() -> None:
    """Programs that resample curves interpolate over the jumps of Euler angles."""
    sequence = person()
    count = len(sequence)
    turns = Rotation.from_euler("z", np.linspace(0.0, 400.0, count)[:, None], degrees=True)
    swing = 100.0 * np.sin(np.linspace(0.0, 6.0, count))[:, None]
    nod = Rotation.from_euler("y", swing, degrees=True)
    spun = (turns * nod).as_rotvec()
    moved = replace(sequence, global_orient=spun)
    text = bvh.write(moved).decode()
    rows = text.split("Frame Time:")[1].splitlines()[1:]
    table = np.array([line.split() for line in rows], float)
    angles = table[:, 3:]
    assert np.abs(np.diff(angles, axis=0)).max() < 180.0
    root = Rotation.from_euler("ZXY", angles[:, :3], degrees=True)
    turned = Rotation.from_matrix(Y_UP_TO_WORLD) * root
    assert (turned * Rotation.from_rotvec(spun).inv()).magnitude().max() < 1e-5


def z_up(text: str) -> str:
    """Return a BVH of ours with z up, as Blender writes it back: (x, y, z) -> (x, -z, y)."""
    turn, lines = Rotation.from_euler("x", 90.0, degrees=True), []
    head, _, table = text.partition("Frame Time:")
    for line in head.splitlines():
        key, _, numbers = line.partition("OFFSET ")
        offset = turn.apply(np.array(numbers.split(), float)) if numbers else None
        lines.append(line if offset is None else f"{key}OFFSET {' '.join(map(str, offset))}")
    period, *rows = table.splitlines()
    lines[-1] += f"\nFrame Time:{period}" if lines[-1] else f"Frame Time:{period}"
    for row in rows:
        numbers = np.array(row.split(), float)
        local = Rotation.from_euler("ZXY", numbers[3:].reshape(-1, 3), degrees=True)
        angles = (turn * local * turn.inv()).as_euler("ZXY", degrees=True)
        places = turn.apply(numbers[:3])
        lines.append(" ".join(map(str, [*places, *angles.ravel()])))
    return "\n".join(lines)


def test_a_skeleton_of_smpl_whose_rest_pose_has_z_up_is_turned_to_smpls_axes() -> None:
    sequence = person()
    found = replace(bvh.read(z_up(bvh.write(sequence).decode()).encode()), to_world=np.eye(3))
    np.testing.assert_allclose(found.rest_joints, sequence.rest_joints, atol=1e-5)
    back = ground_foreign_motion(found, sequence.fps)
    np.testing.assert_allclose(back.body_pose, sequence.body_pose, atol=1e-5)
    quarter = Rotation.from_euler("z", -90.0, degrees=True)
    np.testing.assert_allclose(quarter.apply(sequence.joints[9]), back.joints[9], atol=1e-4)


STICK = """HIERARCHY
ROOT Hips
{
 OFFSET 0 0 0
 CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
 JOINT LeftUpLeg
 { OFFSET 9 -9 0 CHANNELS 3 Zrotation Yrotation Xrotation
  JOINT LeftLeg
  { OFFSET 0 -40 0 CHANNELS 3 Zrotation Yrotation Xrotation
   JOINT LeftFoot
   { OFFSET 0 -41 0 CHANNELS 3 Zrotation Yrotation Xrotation
    End Site { OFFSET 0 -6 18 } } } }
 JOINT RightUpLeg
 { OFFSET -9 -9 0 CHANNELS 3 Zrotation Yrotation Xrotation
  JOINT RightLeg
  { OFFSET 0 -40 0 CHANNELS 3 Zrotation Yrotation Xrotation
   JOINT RightFoot
   { OFFSET 0 -41 0 CHANNELS 3 Zrotation Yrotation Xrotation
    End Site { OFFSET 0 -6 18 } } } }
 JOINT LowerBack
 { OFFSET 0 10 0 CHANNELS 3 Zrotation Yrotation Xrotation
  JOINT Spine
  { OFFSET 0 40 0 CHANNELS 3 Zrotation Yrotation Xrotation
   JOINT Neck
   { OFFSET 0 5 0 CHANNELS 3 Zrotation Yrotation Xrotation
    JOINT Head
    { OFFSET 0 10 0 CHANNELS 3 Zrotation Yrotation Xrotation
     End Site { OFFSET 0 18 0 } } }
   JOINT LeftShoulder
   { OFFSET 2 0 0 CHANNELS 3 Zrotation Yrotation Xrotation
    JOINT LeftArm
    { OFFSET 16 0 0 CHANNELS 3 Zrotation Yrotation Xrotation
     JOINT LeftForeArm
     { OFFSET 28 0 0 CHANNELS 3 Zrotation Yrotation Xrotation
      JOINT LeftHand
      { OFFSET 25 0 0 CHANNELS 3 Zrotation Yrotation Xrotation
       End Site { OFFSET 8 0 0 } } } } }
   JOINT RightShoulder
   { OFFSET -2 0 0 CHANNELS 3 Zrotation Yrotation Xrotation
    JOINT RightArm
    { OFFSET -16 0 0 CHANNELS 3 Zrotation Yrotation Xrotation
     JOINT RightForeArm
     { OFFSET -28 0 0 CHANNELS 3 Zrotation Yrotation Xrotation
      JOINT RightHand
      { OFFSET -25 0 0 CHANNELS 3 Zrotation Yrotation Xrotation
       End Site { OFFSET -8 0 0 } } } } } } }
}
MOTION
Frames: 3
Frame Time: 0.02
"""
NODES = STICK.count("CHANNELS")
ELBOW_BENT = 90.0


def stick(scale: float = 1.0, prefix: str = "", twisted: bool = False) -> bytes:
    """Return three frames of a skeleton like CMU's; in the last one the left elbow points forward.

    Twisted, it also turns its chest and lifts a leg.
    """
    rows = np.zeros((3, 6 + 3 * (NODES - 1)))
    rows[:, 1] = 96.0 * scale
    order = [line.split()[1] for line in STICK.splitlines() if "JOINT" in line or "ROOT" in line]
    rows[2, 6 + 3 * (order.index("LeftForeArm") - 1) + 1] = -ELBOW_BENT
    if twisted:
        rows[1, 6 + 3 * (order.index("Spine") - 1) + 1] = 25.0
        rows[1, 6 + 3 * (order.index("RightUpLeg") - 1) + 2] = -30.0
        rows[:, 4] = [0.0, 40.0, 90.0]
    text = STICK
    for name in order:
        text = text.replace(f"T {name}\n", f"T {prefix}{name}\n")
    words = []
    for line in text.splitlines():
        parts = line.split()
        for at, word in enumerate(parts):
            if word == "OFFSET":
                parts[at + 1 : at + 4] = [str(scale * float(n)) for n in parts[at + 1 : at + 4]]
        words.append(" ".join(parts))
    table = "\n".join(" ".join(map(str, row)) for row in rows)
    head = "\n".join(words) + "\n"
    for word in ("{", "}", "OFFSET", "CHANNELS"):
        head = head.replace(word, f"\n{word}" if word.isalpha() else f"\n{word}\n")
    lines = [line for line in head.splitlines() if line.strip()]
    return ("\n".join(lines) + "\n" + table).encode()


@pytest.mark.parametrize("scale", [0.01, 1.0, 0.01 / 0.0254, 0.01 * 0.45 / 0.0254])
def test_another_skeleton_is_read_in_any_usual_unit(scale: float) -> None:
    sequence = ground_foreign_motion(bvh.read(stick(scale)), 50.0)
    elbow, wrist = keypoint("left_elbow"), keypoint("left_wrist")
    forearm = sequence.joints[:, wrist] - sequence.joints[:, elbow]
    np.testing.assert_allclose(forearm[0], [0.0, 0.25, 0.0], atol=2e-3)
    np.testing.assert_allclose(forearm[2], [0.25, 0.0, 0.0], atol=2e-3)


LIMBS = {
    "left_hip": "LeftUpLeg", "left_ankle": "LeftFoot", "left_shoulder": "LeftArm",
    "left_wrist": "LeftHand", "right_hip": "RightUpLeg", "right_knee": "RightLeg",
    "right_shoulder": "RightArm", "right_elbow": "RightForeArm", "right_wrist": "RightHand",
}  # fmt: skip


def test_another_skeletons_limbs_are_where_an_independent_reader_sees_them(tmp_path: Path) -> None:
    path = tmp_path / "stick.bvh"
    path.write_bytes(stick(twisted=True))
    other = pybvh.read_bvh_file(path)
    names = [node.name for node in other.nodes]
    places = other.node_positions()[:, [names.index(name) for name in LIMBS.values()]]
    expected = places[..., [2, 0, 1]] * CENTIMETRE
    found = ground_foreign_motion(bvh.read(path.read_bytes()), 50.0).joints[
        :, [keypoint(n) for n in LIMBS]
    ]
    shift = np.median(found - expected, axis=(0, 1))
    assert np.abs(shift[:2]).max() < 1e-3
    np.testing.assert_allclose(found - shift, expected, atol=5e-3)


def test_a_skeleton_that_ends_at_the_ankles_stands_on_our_feet() -> None:
    """They are the rest pose's, turned as the shins are: by the hips' heading and a lifted leg."""
    data = stick(twisted=True)
    bare = data.replace(b"OFFSET 0.0 -6.0 18.0", b"OFFSET 0 0 0")
    points, notes = keypoints_of(bvh_tree.parse(bare))
    assert notes == ("no feet in the file: invented",)
    assert keypoints_of(bvh_tree.parse(data))[1] == ()
    size = 40.0 / np.linalg.norm(REST_OFFSETS[keypoint("left_knee")])
    heading = Rotation.from_euler("y", [[0.0], [40.0], [90.0]], degrees=True)
    lift = Rotation.from_euler("x", [[0.0], [-30.0], [0.0]], degrees=True)
    for side, turned in (("left", heading), ("right", heading * lift)):
        knee, ankle, toe = (keypoint(f"{side}_{name}") for name in ("knee", "ankle", "big_toe"))
        shin = REST_JOINTS[ankle] - REST_JOINTS[knee]
        upright, _ = Rotation.align_vectors([[0, -1, 0]], [shin])
        expected = turned.apply(size * upright.apply(REST_JOINTS[toe] - REST_JOINTS[ankle]))
        np.testing.assert_allclose(points[:, toe] - points[:, ankle], expected, atol=0.2)


def test_the_note_on_invented_feet_reaches_the_motion() -> None:
    bare = stick().replace(b"OFFSET 0.0 -6.0 18.0", b"OFFSET 0 0 0")
    assert "no feet in the file: invented" in bvh.read(bare).notes


def test_names_with_a_prefix_are_known() -> None:
    sequence = ground_foreign_motion(bvh.read(stick(prefix="mixamorig:")), 50.0)
    knee, ankle = keypoint("right_knee"), keypoint("right_ankle")
    shin = np.linalg.norm(sequence.joints[0, knee] - sequence.joints[0, ankle])
    assert shin == pytest.approx(0.41, abs=2e-3)


def test_an_unknown_unit_is_scaled_to_a_person_and_reported() -> None:
    motion = bvh.read(stick(3.0))
    assert "unknown unit" in " ".join(motion.notes)
    ankle, hip = keypoint("left_ankle"), keypoint("left_hip")
    assert np.linalg.norm(motion.rest_joints[ankle] - motion.rest_joints[hip]) > 0.5


def test_a_skeleton_without_legs_is_refused_with_its_joints() -> None:
    data = stick().replace(b"LeftUpLeg", b"Tentacle")
    with pytest.raises(BadTable, match=r"left_hip.*Tentacle"):
        bvh.read(data)


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: text.replace("Frames: 3", "Frames: 900000000"),
        lambda text: text.replace("Frame Time: 0.02", "Frame Time: 0"),
        lambda text: text.replace("HIERARCHY", "NOTHING"),
        lambda text: text.replace("CHANNELS 3", "CHANNELS 99999999"),
        lambda text: text.replace("Zrotation", "Wrotation"),
        lambda text: text.replace("96.0", "nan"),
        lambda text: re.sub("OFFSET [^ ]+", "OFFSET nan", text),
        lambda text: re.sub("OFFSET [^ ]+", "OFFSET 1e300", text),
        lambda text: text.replace("Frame Time: 0.02", "Frame Time: 1e-320"),
        lambda text: text[: text.index("MOTION")],
        lambda text: text.replace("{", "}", 1),
        lambda text: "HIERARCHY\nROOT a\n{" + "JOINT b {" * 5000,
    ],
)
def test_a_damaged_file_is_reported(damage: object) -> None:
    with pytest.raises(BadTable, match="BVH"):
        bvh_tree.parse(damage(stick().decode()).encode())  # type: ignore[operator]


@pytest.mark.parametrize("turns", ["Zrotation Zrotation Yrotation", "Xrotation " * 2])
def test_rotations_twice_about_one_axis_are_refused(turns: str) -> None:
    text = (
        stick()
        .decode()
        .replace("3 Zrotation Yrotation Xrotation", f"{len(turns.split())} {turns}", 1)
    )
    with pytest.raises(BadTable, match=r"LeftUpLeg: rotations about [ZX], [ZX]"):
        bvh_tree.parse(text.encode())


def test_a_dancer_below_a_root_that_stands_still_travels() -> None:
    """MotionBuilder puts a `Reference` above the hips, which have the position channels."""
    head, tail = stick().decode().split("ROOT Hips\n{", 1)
    tree, motion = tail.split("MOTION", 1)
    *words, first, second, third = motion.strip().split("\n")
    rows = [f"{10 * k} {row.split(' ', 1)[1]}" for k, row in enumerate((first, second, third))]
    still = "ROOT Reference\n{\n OFFSET 0 0 0\n CHANNELS 3 Zrotation Yrotation Xrotation\n JOINT"
    expected, found = (
        bvh_tree.parse(
            f"{head}{above} Hips\n{{{tree}{close}\nMOTION\n".encode()
            + "\n".join([*words, *(zeros + row for row in rows)]).encode()
        )
        for above, close, zeros in (("ROOT", "", ""), (still, "}", "0 0 0 "))
    )
    np.testing.assert_allclose(found.positions()[:, 1:], expected.positions(), atol=1e-9)
    assert np.ptp(found.positions()[:, 1], axis=0).max() == 20.0
