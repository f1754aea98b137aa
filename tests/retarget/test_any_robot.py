"""A robot that no one knew, by its description alone: ankles, soles, servos, clashing names."""

import hashlib
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from robojackson.errors import BadConfiguration, UnknownName
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import PLANTED
from robojackson.retarget.paper_mapping import mapped
from robojackson.retarget.retarget_config import RepairConfig, RetargetConfig
from robojackson.retarget.retargeting import retarget_motion
from robojackson.rl.sim.motors import Motors
from robojackson.robot.actuation import torque_limits
from robojackson.robot.mjcf import model_sha256
from robojackson.robot.model import Robot, load_robot
from robojackson.robot.tree_kinematics import pose, tree
from tests.fixtures import machine
from tests.fixtures.robots import human

TOE_JOINT = '<joint axis="0 1 0" range="-.123 .123"/>'


@pytest.fixture(scope="module")
def description(tmp_path_factory: pytest.TempPathFactory):
    return machine.description(tmp_path_factory.mktemp("machine"))


@pytest.fixture(scope="module")
def small(description) -> Robot:
    return load_robot(description)


@pytest.fixture(scope="module")
def motion(small: Robot) -> ReferenceMotion:
    config = RetargetConfig(tempo=1.0, repair=RepairConfig(target_share=0.0))
    return retarget_motion(human("walk"), small, config)


def test_a_site_of_the_mjcf_with_a_keypoints_name_keeps_its_place_and_its_sensor(small: Robot):
    model = small.model
    own = model.sensor_objid[0]
    np.testing.assert_allclose(model.site_pos[own], [0.03, 0.0, -0.03])
    assert own not in small.keypoint_sites


def test_the_mass_and_the_hinges_are_those_of_the_mjcf(small: Robot):
    plain = machine.plain_model()
    np.testing.assert_array_equal(small.model.body_mass, plain.body_mass)
    np.testing.assert_array_equal(small.model.jnt_range, plain.jnt_range)


def test_a_floor_is_added_where_there_is_none(small: Robot):
    assert (small.model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)).sum() == 1


def test_bodies_and_hinges_without_a_name_get_one_and_their_motion_can_be_read(tmp_path: Path):
    """Two empty names made a file that nothing could read."""
    described, text = machine.description(tmp_path), machine.mjcf()
    place = '<site name="{}_foot"'
    for side in ("left", "right"):
        toe = f'<body pos=".1 0 0">{TOE_JOINT}<geom size=".005" fromto="0 0 0 .01 0 0"/></body>'
        text = text.replace(place.format(side), toe + place.format(side))
    Path(described.mjcf).write_text(text)
    robot = load_robot(replace(described, torque_limits={"*": 20.0, "joint_7": 3.0}))
    plain = machine.plain_model()
    assert len(robot.joint_names) == plain.njnt - 1 + 2
    assert len(set(robot.joint_names)) == len(robot.joint_names)
    assert len(set(robot.body_names)) == len(robot.body_names) == plain.nbody - 1 + 2
    assert robot.torque_limit[6] == robot.model.actuator("joint_7").gear[0] == 3.0
    assert robot.model.jnt_range[7, 1] == pytest.approx(0.123), "the seventh is the left toe's"
    config = RetargetConfig(tempo=1.0, cyclic="no", repair=RepairConfig(target_share=0.0))
    motion = retarget_motion(human("walk").part(slice(0, 12)), robot, config)
    again = ReferenceMotion.from_bytes(motion.to_bytes(), "reference.parquet")
    assert again.body_names == robot.body_names


def test_the_soles_are_as_deep_whichever_keypoint_of_the_foot_has_the_contacts(
    small: Robot, tmp_path: Path
) -> None:
    """A contact of a toe keypoint was measured from the toe."""
    described = machine.description(tmp_path)
    moved = {
        name: replace(ball, site=f"{ball.side}_toe", offset=(0.0, ball.offset[1], 0.0))
        if "toe" in name
        else ball
        for name, ball in described.contacts.items()
    }
    robot = load_robot(replace(described, contacts=moved))
    np.testing.assert_allclose(robot.contact_arms[1:3, 2], [-0.02, 0.0], atol=5e-3)
    assert robot.sole_depth == pytest.approx(small.sole_depth, abs=1e-12)
    assert small.sole_depth == pytest.approx(0.03, abs=1e-3), "the sole is 3 cm below the ankle"


@pytest.mark.parametrize(
    ("joint", "limit"),
    [("left_knee", 40.0), ("waist", 30.0), ("left_elbow", 7.0), ("left_hip_yaw", np.inf)],
)
def test_torque_limits_of_servos_bounded_joints_and_descriptions(small, joint, limit):
    """Force range of a servo; the joint's own bound under gear x range = 100; by pattern; none."""
    assert small.torque_limit[small.joint_names.index(joint)] == limit


def test_a_motor_without_a_range_has_no_limit_and_those_of_one_joint_add_up(description):
    link = "<body><joint name='{}'/><geom size='.1'/>"
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody><body><freejoint/><geom size='.1'/>{link.format("a")}
        {link.format("b")}</body></body></body></worldbody><actuator><motor joint="a" gear="50"/>
        <motor joint="b" gear="2" ctrlrange="-1 1"/><motor joint="b" gear="3" ctrlrange="-1 1"/>
        </actuator></mujoco>"""
    )
    limits = torque_limits(model, replace(description, torque_limits={}), ("a", "b"))
    assert limits.tolist() == [np.inf, 5.0]


def test_the_papers_mapping_is_refused_where_its_hinges_are_not(small: Robot):
    with pytest.raises(BadConfiguration, match="take method=optimise"):
        mapped(human("hip_shake"), small, np.arange(60) * 0.015, False)


def test_a_pattern_that_means_no_joint_lists_the_joints(description):
    with pytest.raises(UnknownName, match=r"\*_tail.*torque_limits.*left_elbow"):
        load_robot(replace(description, torque_limits={"*_tail": 1.0}))


def test_soles_that_are_not_level_at_rest_are_reported_with_their_heights(description):
    rest = dict(description.rest_pose) | {"*_ankle_pitch": 0.3}
    with pytest.raises(BadConfiguration, match=r"soles are not level.*left_heel_in \d+"):
        load_robot(replace(description, rest_pose=rest))


def test_a_contact_on_another_body_than_its_keypoint_is_refused(description):
    ball = replace(description.contacts["left_toe_in"], body="left_shin")
    contacts = dict(description.contacts) | {"left_toe_in": ball}
    with pytest.raises(BadConfiguration, match=r"left_foot is on 'left_sole', not 'left_shin'"):
        load_robot(replace(description, contacts=contacts))


def test_one_toe_without_the_other_is_refused(description):
    sites = {key: site for key, site in description.sites.items() if key != "right_toe"}
    with pytest.raises(BadConfiguration, match="missing right_toe"):
        load_robot(replace(description, sites=sites, weights={}))


def test_balls_are_at_their_offsets_whatever_the_pose(small: Robot, rng: np.random.Generator):
    qpos = small.standing
    qpos[7:] = rng.uniform(small.lower, small.upper)
    data = mujoco.MjData(small.model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(small.model, data)
    expected = [
        data.body(ball.body).xpos + data.body(ball.body).xmat.reshape(3, 3) @ ball.offset
        for ball in small.description.contacts.values()
    ]
    np.testing.assert_allclose(pose(tree(small), qpos[None]).ball_pos[0], expected, atol=1e-12)


@pytest.mark.medium
def test_the_walk_keeps_all_hard_bars(motion: ReferenceMotion):
    card = motion.scorecard
    assert card["limit_violations"] == 0
    assert card["floor_penetration_mm"] <= 5
    assert card["self_penetration_mm"] <= 5
    assert card["speed_over_limit"] <= 1


@pytest.mark.medium
def test_a_slow_motor_bounds_its_hinge(description, small: Robot, motion: ReferenceMotion):
    """Only `max_joint_speed` bounded a motion, whatever the motors' own `speed_limits` said."""
    knee = next(i for i, name in enumerate(small.joint_names) if "knee" in name)
    limit = 0.8 * float(np.abs(motion.qvel[:, 6 + knee]).max())
    limits = {small.joint_names[knee]: limit}
    slower = load_robot(replace(description, speed_limits=limits))
    config = RetargetConfig(tempo=1.0, repair=RepairConfig(target_share=0.0))
    found = retarget_motion(human("walk"), slower, config)
    assert np.abs(found.qvel[:, 6 + knee]).max() <= limit
    assert found.scorecard["speed_over_limit"] <= 1


@pytest.mark.medium
def test_a_motion_for_hinges_without_motors_is_read_again(
    motion: ReferenceMotion, small: Robot, tmp_path: Path
):
    """And one whose score card has a figure that nothing is known of."""
    assert not small.actuated.all()
    assert not motion.torque_ratio[:, ~small.actuated].any()
    card = {**motion.scorecard, "velocity_score": float("nan")}
    again = ReferenceMotion.load(replace(motion, scorecard=card).save(tmp_path / "r.parquet"))
    np.testing.assert_array_equal(again.torque_ratio, np.float32(motion.torque_ratio))
    assert np.isnan(again.scorecard.pop("velocity_score"))
    card.pop("velocity_score")
    assert dict(again.scorecard) == pytest.approx(card)


@pytest.mark.parametrize(
    ("changes", "limit"),
    [({}, 30.0), ({"torque_limits": {"waist": 80.0}}, 80.0), ({"gear_scale": 3.0}, 90.0)],
)
def test_the_waist_gives_what_is_certified(description, changes: dict[str, object], limit: float):
    robot = load_robot(replace(description, **changes))
    motors, waist = Motors.of(robot.model), robot.joint_names.index("waist")
    (own,) = np.flatnonzero(motors.hinge == waist)
    assert robot.torque_limit[waist] == pytest.approx(limit)
    assert motors.limit[own] == pytest.approx(limit)
    data = mujoco.MjData(robot.model)
    data.ctrl[own] = 100 * motors.limit[own] / motors.gear[own]
    mujoco.mj_forward(robot.model, data)
    assert data.qfrc_actuator[6:][waist] == pytest.approx(limit)


def test_the_walk_is_followed_to_a_tenth_of_the_leg(motion: ReferenceMotion):
    assert motion.scorecard["keypoint_mm"] < 55
    assert motion.scorecard["planted_share"] > 0.5


@pytest.mark.medium
def test_a_foot_that_stands_on_all_corners_is_flat(motion: ReferenceMotion, small: Robot):
    data, tilts = mujoco.MjData(small.model), []
    left = [name.startswith("left") for name in motion.contact_names]
    for qpos, contact in zip(motion.qpos, motion.contact, strict=True):
        if (contact[left] == PLANTED).all():
            data.qpos[:] = qpos
            mujoco.mj_kinematics(small.model, data)
            tilts.append(np.degrees(np.arccos(data.body("left_sole").xmat[8])))
    assert len(tilts) > 3
    assert np.mean(tilts) < 3.0


def test_the_digest_of_a_model_is_that_of_every_file_it_names(tmp_path: Path) -> None:
    whole, part = tmp_path / "scene.xml", tmp_path / "parts" / "body.xml"
    part.parent.mkdir()
    part.write_text("<mujoco><asset><mesh file='arm.stl'/></asset></mujoco>")
    whole.write_text(
        "<mujoco><compiler meshdir='meshes'/><include file='parts/body.xml'/></mujoco>"
    )
    mesh = tmp_path / "meshes" / "arm.stl"
    mesh.parent.mkdir()
    found = set()
    for file, content in ((mesh, "solid"), (mesh, "thicker"), (part, "<mujoco/>")):
        file.write_text(content)
        found.add(model_sha256(whole))
    assert len(found) == 3


def test_the_digest_of_a_model_of_one_file_is_the_files(tmp_path: Path) -> None:
    alone = tmp_path / "alone.xml"
    alone.write_text("<mujoco/>")
    assert model_sha256(alone) == hashlib.sha256(b"<mujoco/>").hexdigest()
