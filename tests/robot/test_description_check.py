"""All that is wrong with a description is reported in one go, a line each."""

import re
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from robojackson.errors import BadConfiguration
from robojackson.robot.description import ContactPoint, FallRule, RobotDescription
from robojackson.robot.description_check import problems
from robojackson.robot.mjcf import mjcf_path
from robojackson.robot.model import load_robot
from robojackson.robot.names import where
from tests.fixtures.own_robot import described_on
from tests.fixtures.robots import description


@pytest.fixture
def humanoid() -> RobotDescription:
    return description()


@pytest.mark.parametrize("name", ["humanoid", "humanoid_strong"])
def test_a_shipped_robot_has_no_problems(name: str) -> None:
    assert problems(description(name)) == []


def test_every_unknown_name_is_reported_at_once(humanoid: RobotDescription) -> None:
    result = problems(
        replace(
            humanoid,
            sites={**humanoid.sites, "left_knee": ("left_chin", (0.0, 0.0, 0.0))},
            weights={**humanoid.weights, "tail": 1.0},
            rest_pose={"left_gnee": 0.1},
            torque_limits={"*_tail": 3.0},
            contacts={"left_foot": ContactPoint("left_foot", 0.1, "left_shoe", "left")},
        )
    )
    words = ["chin", "shoe", "'tail'", "gnee", "*_tail"]
    assert [next(word for word in words if word in line) for line in result] == words


def test_every_missing_site_is_reported(humanoid: RobotDescription) -> None:
    sites = {k: v for k, v in humanoid.sites.items() if k not in ("head", "left_hand")}
    weights = {k: v for k, v in humanoid.weights.items() if k in sites}
    result = problems(replace(humanoid, sites=sites, weights=weights))
    assert [line.rpartition(" ")[2] for line in result] == ["left_hand", "head"]


def test_a_model_that_is_not_there_is_one_line(humanoid: RobotDescription) -> None:
    (found,) = problems(replace(humanoid, mjcf="gone.xml"))
    assert found.endswith("mjcf: no such file: gone.xml")


@pytest.mark.parametrize(
    ("turn", "wrong"), [("0 0 100", True), ("0 80 0", True), ("0 10 10", False)]
)
def test_a_root_that_does_not_stand_upright_and_face_along_x_is_reported(
    turn: str, wrong: bool, humanoid: RobotDescription, tmp_path: Path
) -> None:
    """It would be taken for one that has fallen."""
    text = mjcf_path(humanoid).read_text()
    turned = text.replace('<body name="torso"', f'<body name="torso" euler="{turn}"')
    (tmp_path / "turned.xml").write_text(turned)
    message_text = problems(replace(humanoid, mjcf=str(tmp_path / "turned.xml")))
    assert any("root_body: the axes of 'torso'" in line for line in message_text) == wrong


PLANE = '<geom name="{}" type="plane" size="9 9 1" {}/>'


def with_floor(folder: Path, humanoid: RobotDescription, floor: str) -> RobotDescription:
    """Write Humanoid-v5 with another floor."""
    text, count = re.subn(r'<geom [^>]*name="floor"[^>]*/>', floor, mjcf_path(humanoid).read_text())
    assert count, "one of them is a comment"
    (folder / "floor.xml").write_text(text)
    return replace(humanoid, mjcf=str(folder / "floor.xml"))


@pytest.mark.parametrize(
    ("place", "words"),
    [('pos="0 0 -.5"', r"z = -0\.5 m"), ('euler="0 5 0"', "5 degrees from level"),
     ('pos="1 2 0" euler="0 0 30"', "")],
)  # fmt: skip
def test_a_floor_that_is_not_level_at_zero_is_refused(
    place: str, words: str, humanoid: RobotDescription, tmp_path: Path
) -> None:
    """Motions were made for a floor at z = 0 all the same."""
    described = with_floor(tmp_path, humanoid, PLANE.format("ground", place))
    found = problems(described)
    if not words:
        assert found == []
        return
    (line,) = found
    assert re.search(f"mjcf: the plane 'ground' is at .*{words}", line)
    with pytest.raises(BadConfiguration, match="the plane 'ground'"):
        load_robot(described)


def test_a_wall_is_no_floor(humanoid: RobotDescription, tmp_path: Path) -> None:
    wall = PLANE.format("wall", 'pos="3 0 0" euler="0 -90 0"')
    assert problems(with_floor(tmp_path, humanoid, PLANE.format("ground", "") + wall)) == []
    (line,) = problems(with_floor(tmp_path, humanoid, wall))
    assert "'wall' is a wall and there is no floor" in line


@pytest.mark.parametrize(
    "floor",
    ['<geom name="floor" type="box" size="9 9 .1" pos="0 0 -.1"/>',
     PLANE.format("floor", 'pos="0 0 -.5" contype="0" conaffinity="0"'), ""],
)  # fmt: skip
def test_a_model_without_a_plane_that_can_be_touched_gets_one_at_zero(
    floor: str, humanoid: RobotDescription, tmp_path: Path
) -> None:
    described = with_floor(tmp_path, humanoid, floor)
    assert problems(described) == []
    model = load_robot(described).model
    touches = (model.geom_contype | model.geom_conaffinity) != 0
    (plane,) = np.flatnonzero((model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE) & touches)
    assert model.geom(plane).name == ("floor_" if floor else "floor")
    assert model.geom_pos[plane, 2] == 0.0


def test_limbs_of_different_length_are_reported(humanoid: RobotDescription) -> None:
    sites = {**humanoid.sites, "left_hand": ("left_lower_arm", (0.1, -0.1, 0.1))}
    (found,) = problems(replace(humanoid, sites=sites))
    assert "they must be mirrored" in found


def test_sides_that_are_swapped_are_reported(humanoid: RobotDescription) -> None:
    sites = dict(humanoid.sites)
    for name in ("shoulder", "elbow", "hand"):
        sites[f"left_{name}"], sites[f"right_{name}"] = (
            humanoid.sites[f"{side}_{name}"] for side in ("right", "left")
        )
    result = problems(replace(humanoid, sites=sites))
    assert len(result) == 3
    assert all("to the right of" in line for line in result)


def test_a_keypoint_off_its_mirror_image_is_reported(humanoid: RobotDescription) -> None:
    sites = {
        **humanoid.sites,
        "left_hip": ("left_thigh", (0.03, 0.0, 0.0)),
        "left_knee": ("left_shin", (0.03, 0.0, 0.02)),
        "left_foot": ("left_foot", (0.03, 0.0, 0.1)),
    }
    result = problems(replace(humanoid, sites=sites))
    assert [line.split(": ")[1].split()[0] for line in result] == [
        "sites.left_hip", "sites.left_knee", "sites.left_foot",
    ]  # fmt: skip
    assert "30 mm from the mirror image" in result[0]


def test_a_rest_angle_beyond_its_range_is_reported(humanoid: RobotDescription) -> None:
    (found,) = problems(replace(humanoid, rest_pose={**humanoid.rest_pose, "abdomen_z": 1.0}))
    assert "rest_pose.abdomen_z is 1: beyond its range" in found


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("stand_pose", {"left_knee": -20.0}, "stand_pose.left_knee is -20: beyond its range"),
        ("fall", FallRule(tilt=45.0), "fall.tilt is 45: at most 3.14 radians"),
        ("imu", (0.0, 0.0, 100.0), "imu: 100 m is more than the whole robot"),
        (
            "fixed_joints",
            {"abdomen_z": -30.0},
            "fixed_joints.abdomen_z is -30",
        ),
    ],
)
def test_degrees_and_millimetres_are_reported(
    key: str, value: object, words: str, humanoid: RobotDescription
) -> None:
    found = problems(replace(humanoid, **{key: value}))
    assert words in found[0]


def test_lengths_beyond_the_robot_are_refused_all_at_once(humanoid: RobotDescription) -> None:
    sites = {**humanoid.sites, "pelvis": ("pelvis", (0.0, 0.0, -40.0))}
    contacts = {
        **humanoid.contacts,
        "left_foot": replace(humanoid.contacts["left_foot"], radius=75.0, offset=(0.0, 9.0, 0.0)),
    }
    wrong = replace(humanoid, sites=sites, contacts=contacts)
    places = ["sites.pelvis: 40 m", "contacts.left_foot.offset: 9 m", "left_foot.radius: 75 m"]
    found = problems(wrong)
    assert [place in line for place, line in zip(places, found, strict=True)] == [True] * 3
    with pytest.raises(BadConfiguration, match=r"sites.pelvis: 40 m .* lengths are in metres"):
        load_robot(wrong)


def test_a_wrong_pattern_of_every_key_is_reported(humanoid: RobotDescription) -> None:
    keys = ("stand_pose", "speed_limits", "armature", "stiffness", "damping",
            "natural_frequency", "damping_ratio", "action_scale")  # fmt: skip
    result = problems(replace(humanoid, **{key: {"*_kne": 1.0} for key in keys}))
    assert [next(key for key in keys if f": {key})" in line) for line in result] == list(keys)


def test_what_mujoco_cannot_compile_names_the_key(
    humanoid: RobotDescription, tmp_path: Path
) -> None:
    described = described_on(tmp_path, ('joint="right_knee"', 'joint="right_hip_y"'))
    (found,) = problems(described)
    assert found.startswith(f"{where(described, 'mjcf')}: Error: ")
    assert "repeated" in found


BALL = '<body name="ball" pos="2 0 .2"><freejoint/><geom size=".1" mass=".4"/></body>'
SLIDE = 'range="-45 45" stiffness="20" type="slide"'
TURN = (
    '<joint armature="0" damping="0" limited="false" name="root" pos="0 0 0" stiffness="0" type="'
)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<worldbody>", f"<worldbody>{BALL}", "'ball' has the free joint: only 'torso' may move"),
        ("</worldbody>", f"{BALL}</worldbody>", "'ball' has the free joint: only 'torso' may move"),
        (SLIDE.replace("slide", "hinge"), SLIDE, "the slide joint 'abdomen_z': a robot has hinges"),
        (f'{TURN}free"/>', "", "root_body: 'torso' has no free joint; give it one"),
    ],
)
def test_a_joint_that_no_robot_has_is_named_with_a_remedy(
    old: str, new: str, words: str, tmp_path: Path
) -> None:
    described = described_on(tmp_path, (old, new))
    (found,) = problems(described)
    assert words in found
    with pytest.raises(BadConfiguration, match="joint"):
        load_robot(described)
