"""A robot without some of its hinges is the whole robot with these hinges held still."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from robojackson.errors import UnknownName
from robojackson.retarget.retarget_config import RepairConfig, RetargetConfig
from robojackson.retarget.retargeting import retarget_motion
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.sim.motors import Motors, gains
from robojackson.robot.description import RobotDescription
from robojackson.robot.description_check import problems
from robojackson.robot.fixed_joints import fix_joints
from robojackson.robot.model import load_robot
from tests.fixtures import machine
from tests.fixtures.robots import human

FIXED = {"*_shoulder_roll": 0.5, "left_hip_yaw": -0.3, "*_ankle_roll": 0.0, "waist": 0.4}
REFERRING = """<mujoco><compiler angle="degree"/><worldbody>
<body name="a"><freejoint name="root"/><geom size=".1"/>
 <frame pos="0 0 1" euler="30 0 0"><frame pos=".1 0 0" euler="0 20 0">
  <body name="b" pos="1 0 0" euler="0 0 40"><geom size=".1" pos="0 .2 .3"/>
   <joint name="turn" axis="0 0 1" ref="10" range="-90 90" pos="0 .1 0"/>
   <joint name="tip" axis="0 1 0" range="-90 90" pos=".1 0 .2"/>
   <joint name="roll" axis="1 0 0" range="-90 90" pos="0 0 -.1"/>
   <body name="c" pos="0 0 .5"><joint name="end" axis="1 1 0" range="-90 90"/><geom size=".1"/>
   </body></body></frame></frame></body></worldbody>
<tendon><fixed name="two"><joint joint="tip" coef="1"/><joint joint="end" coef="1"/></fixed>
 <fixed name="one"><joint joint="end" coef="1"/></fixed></tendon>
<equality><joint name="coupled" joint1="end" joint2="tip"/><joint name="held" joint1="end"/>
 <weld name="glued" body1="b" body2="a"/>
 <tendon name="taut" tendon1="one" tendon2="two"/></equality>
<actuator><motor name="tip" joint="tip"/><motor joint="roll"/><motor name="pull" tendon="two"/>
 <position name="end" joint="end" kp="3"/></actuator>
<sensor><jointpos name="tip" joint="tip"/><actuatorfrc name="force" actuator="tip"/>
 <tendonpos name="length" tendon="two"/><jointpos name="end" joint="end"/></sensor>
<contact><exclude name="apart" body1="a" body2="c"/></contact>
<keyframe><key name="home" qpos="0 0 0 1 0 0 0 0 0 0 0" ctrl="0 0 0 0"/></keyframe></mujoco>"""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> RobotDescription:
    found = machine.description(tmp_path_factory.mktemp("machine"))
    return replace(found, torque_limits={"*": 20.0})


@pytest.fixture(scope="module")
def less(whole: RobotDescription) -> RobotDescription:
    return replace(whole, fixed_joints=FIXED)


def posed(model: mujoco.MjModel, angles: dict[str, float]) -> mujoco.MjData:
    data = mujoco.MjData(model)
    for name, angle in angles.items():
        data.joint(name).qpos[:] = angle
    mujoco.mj_forward(model, data)
    return data


def hinges(model: mujoco.MjModel) -> list[str]:
    return [model.joint(index).name for index in range(1, model.njnt)]


def without(xml: str, angles: dict[str, float], like: RobotDescription) -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_string(xml)
    fix_joints(spec, replace(like, fixed_joints=angles))
    return spec.compile()


def test_every_body_is_where_the_whole_robot_has_it_at_these_angles(
    whole: RobotDescription, less: RobotDescription, rng: np.random.Generator
) -> None:
    full, part = load_robot(whole).model, load_robot(less).model
    held = {"waist": 0.4, "left_hip_yaw": -0.3}
    for side in ("left", "right"):
        held |= {f"{side}_shoulder_roll": 0.5, f"{side}_ankle_roll": 0.0}
    assert set(hinges(part)) == set(hinges(full)) - set(held)
    for _ in range(5):
        free = {name: rng.uniform(*part.joint(name).range) for name in hinges(part)}
        ours, theirs = posed(part, free), posed(full, free | held)
        np.testing.assert_allclose(ours.xpos, theirs.xpos, atol=1e-12)
        np.testing.assert_allclose(ours.xmat, theirs.xmat, atol=1e-12)
        np.testing.assert_allclose(ours.geom_xpos, theirs.geom_xpos, atol=1e-12)
        np.testing.assert_allclose(ours.site_xpos, theirs.site_xpos, atol=1e-12)
        np.testing.assert_allclose(ours.subtree_com, theirs.subtree_com, atol=1e-12)


def test_no_mass_and_no_geom_goes(whole: RobotDescription, less: RobotDescription) -> None:
    full, part = load_robot(whole).model, load_robot(less).model
    np.testing.assert_array_equal(part.body_mass, full.body_mass)
    np.testing.assert_array_equal(part.body_inertia, full.body_inertia)
    np.testing.assert_array_equal(part.geom_size, full.geom_size)


@pytest.mark.parametrize(
    "fixed", [{"tip": 0.7}, {"turn": -0.4}, {"roll": 0.3, "turn": 0.0}, {"tip": 1.0, "end": 0.2}]
)
def test_frames_degrees_references_and_shifted_axes_are_respected(
    fixed: dict[str, float], whole: RobotDescription
) -> None:
    """Of several hinges of one body, which turn about points beside its origin."""
    full, part = mujoco.MjModel.from_xml_string(REFERRING), without(REFERRING, fixed, whole)
    free = {name: 0.3 + 0.2 * i for i, name in enumerate(hinges(part))}
    ours, theirs = posed(part, free), posed(full, free | fixed)
    np.testing.assert_allclose(ours.xpos, theirs.xpos, atol=1e-12)
    np.testing.assert_allclose(ours.xmat, theirs.xmat, atol=1e-12)


def test_what_refers_to_a_removed_hinge_goes_with_it_and_nothing_else(
    whole: RobotDescription,
) -> None:
    part = without(REFERRING, {"tip": 0.0}, whole)
    assert hinges(part) == ["turn", "roll", "end"]
    assert [part.tendon(i).name for i in range(part.ntendon)] == ["one"]
    assert [part.equality(i).name for i in range(part.neq)] == ["held", "glued"]
    assert [part.actuator(i).name for i in range(part.nu)] == ["", "end"]
    assert [part.sensor(i).name for i in range(part.nsensor)] == ["end"]
    assert (part.nexclude, part.nkey) == (1, 0)


def test_a_pattern_that_matches_no_hinge_is_named(whole: RobotDescription) -> None:
    with pytest.raises(UnknownName, match=r"\*_tail.*fixed_joints.*left_elbow"):
        load_robot(replace(whole, fixed_joints={"*_tail": 0.0}))


def test_whatever_else_names_a_removed_hinge_is_refused(less: RobotDescription) -> None:
    wrong = replace(less, armature={"waist": 0.01})
    with pytest.raises(UnknownName, match=r"'waist'.*armature"):
        load_robot(wrong)
    (line,) = problems(replace(less, rest_pose=dict(less.rest_pose) | {"waist": 0.1}))
    assert "'waist'" in line
    assert "rest_pose" in line


def test_a_policy_moves_the_hinges_that_are_left(less: RobotDescription) -> None:
    robot = load_robot(less)
    motors = Motors.of(robot.model)
    assert sorted(motors.hinge) == list(range(len(robot.joint_names)))
    kp, kd = gains(robot, ControlConfig())
    assert len(kp) == len(kd) == len(robot.joint_names)


@pytest.mark.medium
def test_a_motion_has_the_hinges_that_are_left(less: RobotDescription) -> None:
    robot = load_robot(replace(less, fixed_joints={"*_hip_yaw": 0.0}))
    config = RetargetConfig(tempo=1.0, repair=RepairConfig(target_share=0.0))
    motion = retarget_motion(human("hip_shake"), robot, config)
    assert motion.qpos.shape[1] == 7 + len(robot.joint_names) == 7 + 19
    assert motion.scorecard["keypoint_mm"] < 60
