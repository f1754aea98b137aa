"""What a YAML adds to a model: motors, armature, gains, stepping, the fall rule."""

import dataclasses
import importlib.util
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

from robojackson.errors import BadConfiguration, UnknownName
from robojackson.formats.deploy.robot_xml import robot_xml
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.retarget.feasibility.inverse_dynamics import sole_friction
from robojackson.retarget.solver.collision import Detector
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.modes.reset_states import default_standing_pose
from robojackson.rl.sim.motors import Motors, gains
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.sim.trainable import require_trainable
from robojackson.robot.description import FallRule, RobotDescription, SimulationDescription
from robojackson.robot.fall import Fall, standing_height, up_axis
from robojackson.robot.model import Robot, load_robot
from tests.fixtures import machine

HUMANOID = describe_robot("humanoid")
OCTAHEDRON = "".join(
    f"v {x} {y} {z}\n"
    for x, y, z in [
        (0.1, 0, 0),
        (-0.1, 0, 0),
        (0, 0.05, 0),
        (0, -0.05, 0),
        (0, 0, 0.01),
        (0, 0, -0.01),
    ]
) + "".join(f"f {x} {y} {z}\n" for x in (1, 2) for y in (3, 4) for z in (5, 6))


def altered(**changes: object) -> Robot:
    return load_robot(dataclasses.replace(HUMANOID, **changes))


def stock_model() -> mujoco.MjModel:
    found = importlib.util.find_spec("gymnasium")
    assert found is not None
    assert found.origin is not None
    folder = Path(found.origin).parent
    return mujoco.MjModel.from_xml_path(str(folder / "envs/mujoco/assets/humanoid.xml"))


def saved(model: mujoco.MjModel) -> bytes:
    """Return a compiled model as MuJoCo saves it."""
    content = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    return content.tobytes()


def test_the_humanoids_yaml_says_what_its_model_has(robot: Robot) -> None:
    stock, ours = stock_model(), robot.model
    assert (ours.opt.timestep, ours.opt.integrator) == (stock.opt.timestep, stock.opt.integrator)
    assert ours.opt.iterations == stock.opt.iterations
    for name in ("dof_armature", "dof_damping", "actuator_gear", "actuator_ctrlrange"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(stock, name))
    np.testing.assert_array_equal(ours.geom_friction, stock.geom_friction)
    motors = dataclasses.replace(HUMANOID, torque_limits={})
    np.testing.assert_allclose(load_robot(motors).torque_limit, robot.torque_limit)


def test_the_humanoids_physics_is_its_model_s_to_the_bit(robot: Robot) -> None:
    said = describe_robot("humanoid")
    assert said.armature
    assert said.simulation.friction is not None
    silent = load_robot(
        dataclasses.replace(said, torque_limits={}, armature={}, simulation=SimulationDescription())
    )
    assert saved(robot.model) == saved(silent.model)


def test_the_humanoids_gains_are_those_of_the_rule_without_a_yaml(robot: Robot) -> None:
    bare = altered(stiffness={}, damping={}).actuation
    np.testing.assert_array_equal(bare.stiffness, robot.actuation.stiffness)
    np.testing.assert_array_equal(bare.damping, robot.actuation.damping)


def test_a_limited_hinge_without_an_actuator_gets_a_motor(tmp_path: Path) -> None:
    text = Path(load_robot(HUMANOID).description.mjcf.replace("gymnasium:", "")).name
    folder = Path(importlib.util.find_spec("gymnasium").origin).parent  # type: ignore
    source = (folder / "envs/mujoco/assets" / text).read_text()
    start, end = source.index("<actuator>"), source.index("</actuator>") + len("</actuator>")
    bare = tmp_path / "bare.xml"
    bare.write_text(source[:start] + source[end:])
    limits = {"*": 30.0, "*_knee": 80.0}
    robot = altered(mjcf=str(bare), torque_limits=limits)
    assert robot.model.nu == len(robot.joint_names)
    knee = robot.model.actuator("left_knee")
    assert knee.gear[0] == 80.0
    np.testing.assert_array_equal(knee.ctrlrange, [-1.0, 1.0])
    assert robot.torque_limit[robot.joint_names.index("abdomen_y")] == 30.0


def test_a_servo_of_a_limited_hinge_gives_way_to_a_motor(tmp_path: Path) -> None:
    """The PD law is ours; training takes torque motors alone."""
    described = machine.description(tmp_path)
    with pytest.raises(BadConfiguration, match="not a torque motor"):
        require_trainable(load_robot(described))
    armature = {"*": 0.02}
    robot = load_robot(dataclasses.replace(described, torque_limits={"*": 20.0}, armature=armature))
    require_trainable(robot)
    knee = robot.model.actuator("left_knee")
    assert (knee.biastype[0], knee.gear[0]) == (mujoco.mjtBias.mjBIAS_NONE, 20.0)
    assert robot.model.nu == len(robot.joint_names)


def test_excluded_bodies_do_not_collide(tmp_path: Path) -> None:
    described = machine.description(tmp_path)
    bent = {"left_elbow": -2.4, "left_shoulder_roll": -0.6}  # the arm is in the chest

    def touching(excludes: tuple[tuple[str, str], ...]) -> set[frozenset[str]]:
        model = load_robot(dataclasses.replace(described, collision_excludes=excludes)).model
        data = mujoco.MjData(model)
        for name, angle in bent.items():
            data.joint(name).qpos[:] = angle
        mujoco.mj_forward(model, data)
        bodies = model.geom_bodyid[data.contact.geom]
        return {frozenset(model.body(body).name for body in pair) for pair in bodies}

    pairs = [("left_upper", "chest"), ("left_lower", "chest"), ("left_upper", "base")]
    assert touching(()) & {frozenset(pair) for pair in pairs}
    assert not touching(tuple(pairs)) & {frozenset(pair) for pair in pairs}
    with pytest.raises(UnknownName, match=r"'tail'.*collision_excludes"):
        touching((("chest", "tail"),))


@pytest.fixture
def on_balls(tmp_path: Path) -> Robot:
    """Return the machine with a ball under each heel that is a body of its own, welded to the
    sole."""
    described = machine.description(tmp_path)
    ball = (
        '<body name="{}_ball" pos="-.04 0 -.03"><geom type="sphere" size=".01" mass=".01"/></body>'
    )
    text = machine.mjcf()
    for side in ("left", "right"):
        site = f'<site name="{side}_foot"'
        text = text.replace(site, ball.format(side) + site)
    Path(described.mjcf).write_text(text)
    simulation = SimulationDescription(friction=0.4)
    return load_robot(dataclasses.replace(described, simulation=simulation))


def test_a_body_that_is_welded_to_a_foot_is_of_the_foot(on_balls: Robot) -> None:
    model = on_balls.model
    names = {model.body(int(body)).name for body in on_balls.foot_bodies}
    assert names == {"left_sole", "left_ball", "right_sole", "right_ball"}
    feet = np.isin(model.geom_bodyid, on_balls.foot_bodies)
    np.testing.assert_array_equal(model.geom_friction[feet, 0], 0.4)
    assert (model.geom_friction[~feet & (model.geom_bodyid > 0), 0] == 1.0).all()
    stand = default_standing_pose(on_balls)
    assert Detector(on_balls, 0.01).touches(stand[None]).floor.any()
    assert not Detector(on_balls, 0.01, feet=False).touches(stand[None]).floor.any()


def test_a_sole_of_its_own_that_is_welded_to_the_foot_is_the_whole_foot(tmp_path: Path) -> None:
    """A frame under the foot that carries keypoint and contacts left the foot out of the feet."""
    described, text = machine.description(tmp_path), machine.mjcf()
    sites, contacts = dict(described.sites), dict(described.contacts)
    for side in ("left", "right"):
        site = f'<site name="{side}_foot"'
        text = text.replace(site, f'<body name="{side}_frame" pos="0 0 -.01"/>{site}')
        for key in (f"{side}_foot", f"{side}_toe"):
            x, y, z = sites[key][1]
            sites[key] = (f"{side}_frame", (x, y, z + 0.01))
    for name, ball in contacts.items():
        contacts[name] = dataclasses.replace(ball, body=f"{ball.side}_frame")
    Path(described.mjcf).write_text(text)
    simulation = SimulationDescription(friction=0.4)
    changes = {"sites": sites, "contacts": contacts, "simulation": simulation}
    robot = load_robot(dataclasses.replace(described, **changes))
    model = robot.model
    names = {model.body(int(body)).name for body in robot.foot_bodies}
    assert names == {"left_sole", "left_frame", "right_sole", "right_frame"}
    soles = [model.geom_bodyid[g] in robot.foot_bodies for g in range(model.ngeom)]
    assert sum(soles) == 2
    np.testing.assert_array_equal(model.geom_friction[soles, 0], 0.4)
    np.testing.assert_array_equal(sole_friction(robot), 0.4)
    stand = default_standing_pose(robot)
    assert not Detector(robot, 0.01, feet=False).touches(stand[None]).floor.any()


def test_a_leg_that_a_foot_with_geoms_is_welded_to_is_not_of_the_foot(robot: Robot) -> None:
    """Humanoid-v5 has no ankles."""
    feet = {robot.model.body(int(body)).name for body in robot.foot_bodies}
    assert feet == {"left_foot", "right_foot"}


def with_motors(path: Path, change: Callable[[str], str]) -> str:
    """Write the stock humanoid with other actuators; return the path of its MJCF."""
    found = importlib.util.find_spec("gymnasium")
    assert found is not None
    assert found.origin is not None
    text = (Path(found.origin).parent / "envs/mujoco/assets/humanoid.xml").read_text()
    start = text.index("<actuator>")
    path.write_text(text[:start] + change(text[start:]))
    return str(path)


@pytest.mark.parametrize("gain", ['gainprm="1"', 'gainprm="-50"', 'forcerange="-.2 .2"'])
@pytest.mark.parametrize("usual", [30.0, 40.0])
def test_a_motor_of_the_mjcf_gives_what_the_yaml_allows(
    tmp_path: Path, gain: str, usual: float
) -> None:
    """What retargeting reckons with is what the simulation gives, whatever its gear, its gain and
    its range of forces."""
    general = f"<general {gain} "
    mjcf = with_motors(tmp_path / "motors.xml", lambda text: text.replace("<motor ", general))
    robot = altered(mjcf=mjcf, torque_limits={"*": usual, "abdomen_z": 10.0})
    require_trainable(robot)
    motors, data = Motors.of(robot.model), mujoco.MjData(robot.model)
    np.testing.assert_allclose(motors.limit, robot.torque_limit[motors.hinge])
    data.ctrl[:] = 2 * motors.limit / motors.gear
    mujoco.mj_forward(robot.model, data)
    np.testing.assert_allclose(data.qfrc_actuator[6:][motors.hinge], motors.limit)


@pytest.mark.parametrize(
    "kind", ['general dyntype="filter" dynprm=".1"', 'motor ctrlrange="-1 .5"']
)
def test_a_motor_that_the_control_law_cannot_use_is_refused(tmp_path: Path, kind: str) -> None:
    mjcf = with_motors(tmp_path / "m.xml", lambda text: text.replace("<motor ", f"<{kind} ", 1))
    with pytest.raises(BadConfiguration, match=r"'abdomen_y' is not (a torque motor|the same in)"):
        require_trainable(altered(mjcf=mjcf, torque_limits={}))


@pytest.mark.parametrize(
    ("motor", "joint"),
    [('forcerange="-.05 .4"', ""), ('forcerange="-.4 .05"', ""),
     ("", 'actuatorfrcrange="-10 60"'), ('forcerange="-.3 .4"', 'actuatorfrcrange="-60 10"')],
)  # fmt: skip
def test_of_a_force_range_that_differs_in_direction_the_smaller_side_counts(
    motor: str, joint: str, tmp_path: Path
) -> None:
    """The larger did: a certificate promised torques that the robot has in one direction."""
    path = tmp_path / "motors.xml"
    with_motors(path, lambda text: text.replace(KNEE, KNEE.replace("/>", f" {motor}/>")))
    path.write_text(path.read_text().replace('name="right_knee"', f'{joint} name="right_knee"', 1))
    robot = altered(mjcf=str(path), torque_limits={})
    require_trainable(robot)
    knee = robot.joint_names.index("right_knee")
    motors = Motors.of(robot.model)
    (own,) = np.flatnonzero(motors.hinge == knee)
    assert robot.torque_limit[knee] == pytest.approx(10.0)
    assert motors.limit[own] == pytest.approx(10.0)
    data = mujoco.MjData(robot.model)
    for torque in (-10.0, 10.0):
        data.ctrl[own] = torque / motors.gear[own]
        mujoco.mj_forward(robot.model, data)
        assert data.qfrc_actuator[6 + knee] == pytest.approx(torque)
    named = altered(mjcf=str(path), torque_limits={"right_knee": 50.0})
    data = mujoco.MjData(named.model)
    for sign in (-1.0, 1.0):
        data.ctrl[own] = sign
        mujoco.mj_forward(named.model, data)
        assert data.qfrc_actuator[6 + knee] == pytest.approx(sign * 50.0), "as the YAML says"


def test_a_motor_that_only_pulls_is_refused(tmp_path: Path) -> None:
    pulls = KNEE.replace("/>", ' forcerange="0 .4"/>')
    mjcf = with_motors(tmp_path / "m.xml", lambda text: text.replace(KNEE, pulls))
    robot = altered(mjcf=mjcf, torque_limits={})
    with pytest.raises(BadConfiguration, match="'right_knee' or of its joint allows one direction"):
        require_trainable(robot)


def test_a_factor_on_the_torque_goes_beyond_what_the_hinge_allowed(tmp_path: Path) -> None:
    """The bound of a hinge that `torque_limits` does not name stayed as the MJCF has it."""
    described = machine.description(tmp_path)
    robot = load_robot(dataclasses.replace(described, gear_scale=3.0))
    waist = robot.joint_names.index("waist")
    assert robot.torque_limit[waist] == 90.0, "three times the 30 Nm of the MJCF"
    written = mujoco.MjModel.from_xml_string(robot_xml(robot).decode())
    for model in (robot.model, written):
        data = mujoco.MjData(model)
        data.ctrl[model.actuator_trnid[:, 0] == 1 + waist] = 50.0
        mujoco.mj_forward(model, data)
        assert data.qfrc_actuator[6 + waist] == pytest.approx(90.0)


KNEE = '<motor gear="200" joint="right_knee" name="right_knee"/>'


@pytest.mark.parametrize("second", [50, 200])
@pytest.mark.parametrize("limits", [{}, {"right_knee": 90.0}])
def test_motors_of_one_hinge_have_its_gains_together(
    second: float, limits: dict[str, float], tmp_path: Path
) -> None:
    """Each had the whole: two of them were twice as stiff."""
    more = f'{KNEE}<motor gear="{second}" joint="right_knee" name="second"/>'
    mjcf = with_motors(tmp_path / "two.xml", lambda text: text.replace(KNEE, more))
    robot = altered(mjcf=mjcf, torque_limits=limits)
    knee, error = robot.joint_names.index("right_knee"), 0.01
    sim = Simulation(robot, ControlConfig(law="hold"), 1)
    both = sim.motors.hinge == knee
    assert both.sum() == 2
    start = np.array([robot.standing])
    sim.place(np.zeros(1, int), start, np.zeros((1, robot.model.nv)))
    sim.step(start[:, 7:][:, sim.motors.hinge] + error * both)
    torque = sim.datas[0].ctrl * sim.motors.gear
    assert torque[both].sum() == pytest.approx(error * robot.actuation.stiffness[knee])
    assert np.ptp(torque[both] / sim.motors.limit[both]) < 1e-9, "each by its limit"
    assert sim.kd[both].sum() == pytest.approx(robot.actuation.damping[knee])


def test_a_motor_alone_has_the_gains_of_its_hinge_to_the_bit(robot: Robot) -> None:
    (kp, kd), hinge = gains(robot, ControlConfig()), Motors.of(robot.model).hinge
    np.testing.assert_array_equal(kp, robot.actuation.stiffness[hinge])
    np.testing.assert_array_equal(kd, robot.actuation.damping[hinge])


@pytest.mark.parametrize("shape", ["box", "mesh", "cylinder", "ellipsoid"])
def test_the_stand_is_on_the_floor_whatever_the_shape_of_the_soles(
    shape: str, tmp_path: Path
) -> None:
    described, text = machine.description(tmp_path), machine.mjcf()
    sole = 'type="box" size=".07 .03 .01" pos=".03'
    assert sole in text
    if shape == "mesh":
        (tmp_path / "sole.obj").write_text(OCTAHEDRON)
        text = text.replace("<worldbody>", '<asset><mesh file="sole.obj"/></asset><worldbody>')
        text = text.replace(sole, 'type="mesh" mesh="sole" pos=".03')
    elif shape != "box":
        tilted = f'type="{shape}" size=".04 .02 .03" euler="20 30 0" pos=".03'
        text = text.replace(sole, tilted)
    Path(described.mjcf).write_text(text)
    robot = load_robot(described)
    data = mujoco.MjData(robot.model)
    data.qpos[:] = default_standing_pose(robot)
    data.qpos[2] -= 1e-4
    mujoco.mj_forward(robot.model, data)
    assert data.contact.dist.min() == pytest.approx(-1e-4, abs=2e-6)


def test_gains_of_a_natural_frequency_are_those_of_a_damped_oscillator() -> None:
    """m x'' + kd x' + kp x = 0 has w0 = sqrt(kp / m) and ratio kd / (2 sqrt(kp m))."""
    found = altered(
        stiffness={}, damping={}, armature={"*": 0.02}, natural_frequency={"*": 10.0},
        damping_ratio={"*": 1.5},
    ).actuation  # fmt: skip
    np.testing.assert_allclose(np.sqrt(found.stiffness / 0.02), 2 * np.pi * 10)
    np.testing.assert_allclose(found.damping / (2 * np.sqrt(found.stiffness * 0.02)), 1.5)


@pytest.mark.parametrize("stiffness", [{"*": 40.0}, {}])
def test_a_damping_ratio_holds_for_any_stiffness(stiffness: dict[str, float]) -> None:
    """It was ignored where no natural frequency was named beside it."""
    found = altered(stiffness=stiffness, damping={}, armature={"*": 0.02}, damping_ratio={"*": 0.7})
    gains = found.actuation
    np.testing.assert_allclose(gains.damping / (2 * np.sqrt(gains.stiffness * 0.02)), 0.7)


def test_a_damping_ratio_needs_an_armature() -> None:
    with pytest.raises(BadConfiguration, match=r"damping_ratio.*has no armature"):
        altered(damping={}, armature={"*": 0.0}, damping_ratio={"*": 0.7})


def test_the_last_pattern_that_matches_counts() -> None:
    scale = altered(action_scale={"*": 0.4, "left_*": 0.2}).actuation.action_scale
    names = load_robot(HUMANOID).joint_names
    expected = [0.2 if name.startswith("left_") else 0.4 for name in names]
    np.testing.assert_array_equal(scale, expected)


@pytest.mark.parametrize("key", ["armature", "stiffness", "damping", "action_scale", "stand_pose"])
def test_a_hinge_that_does_not_exist_is_named(key: str) -> None:
    with pytest.raises(UnknownName, match=f"left_wing.*{key}"):
        altered(**{key: {"left_wing": 1.0}})


def test_stepping_is_as_the_yaml_says() -> None:
    stepping = SimulationDescription(
        timestep=0.005, integrator="implicitfast", iterations=7, ls_iterations=9, friction=0.6
    )
    robot = altered(simulation=stepping)
    option = robot.model.opt
    assert (option.timestep, option.iterations, option.ls_iterations) == (0.005, 7, 9)
    assert option.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert robot.substeps == 3
    model = robot.model
    floor = model.geom("floor").id
    soles = [i for i in range(model.ngeom) if model.geom_bodyid[i] in robot.contact_bodies]
    np.testing.assert_array_equal(model.geom_friction[[floor, *soles], 0], 0.6)


def test_a_control_step_is_a_whole_number_of_physics_steps() -> None:
    with pytest.raises(BadConfiguration, match=r"control_dt: 15 ms .* steps of 4 ms"):
        altered(simulation=SimulationDescription(timestep=0.004))


def tilted(qpos: np.ndarray, angle: float) -> np.ndarray:
    out = qpos.copy()
    out[:, 3:7] = [np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0]
    return out


def test_the_papers_fall_rule_looks_at_the_world(robot: Robot) -> None:
    rule = Fall.of(robot)
    high = np.tile(robot.standing, (1, 1))
    low = high.copy()
    low[:, 2] = 0.69
    assert not rule.has_fallen(high, low).any()
    assert rule.has_fallen(low, low).all()
    assert rule.has_fallen(tilted(high, 1.06), high).all()


def test_a_bow_is_no_fall_where_the_reference_bows() -> None:
    robot = altered(fall=FallRule(frame="reference", height=0.25, tilt=0.8))
    rule, stand = Fall.of(robot), np.tile(robot.standing, (1, 1))
    bow = tilted(stand, 1.3)
    bow[:, 2] -= 0.3
    assert not rule.has_fallen(bow, bow).any()
    assert rule.has_fallen(stand, bow).all()
    turned = stand.copy()
    turned[:, 3:7] = [np.cos(1.0), 0.0, 0.0, np.sin(1.0)]
    assert not rule.has_fallen(turned, stand).any(), "a heading is no tilt"


def test_the_up_axis_is_mujocos(robot: Robot, poses: np.ndarray) -> None:
    data = mujoco.MjData(robot.model)
    root = robot.model.body(robot.description.root_body).id
    for qpos in poses[:5]:
        data.qpos[:] = qpos
        mujoco.mj_kinematics(robot.model, data)
        expected = data.xmat[root].reshape(3, 3)[:, 2]
        np.testing.assert_allclose(up_axis(qpos[None, 3:7])[0], expected, atol=1e-9)


def test_a_small_robot_falls_lower(robot: Robot) -> None:
    assert Fall.of(robot).height == 0.7
    free = RobotDescription(**{**vars(HUMANOID), "fall": FallRule()})
    assert Fall.of(load_robot(free)).height == pytest.approx(
        min(0.7, 0.55 * standing_height(robot))
    )


def test_a_natural_frequency_needs_an_armature() -> None:
    """Its gains would be zero, and their ratio no number: MuJoCo would turn off every motor."""
    with pytest.raises(BadConfiguration, match=r"_elbow has no armature.*name its armature"):
        altered(
            stiffness={}, damping={}, armature={"*": 0.02, "*_elbow": 0.0},
            natural_frequency={"*_elbow": 10.0},
        )  # fmt: skip


def test_a_fall_rule_without_a_tilt_is_never_by_tilt() -> None:
    robot = load_robot(HUMANOID)
    leaning = default_standing_pose(robot)[None]
    leaning[:, 3:7] = [np.cos(0.5), np.sin(0.5), 0.0, 0.0]
    assert Fall(False, 0.1, 0.9).has_fallen(leaning, leaning).all()
    assert not Fall(False, 0.1, 2 * np.pi).has_fallen(leaning, leaning).any()


def test_a_body_touches_the_floor_below_the_clearance_and_no_higher() -> None:
    robot = load_robot(HUMANOID)
    detector = Detector(robot, 0.005, feet=False)
    lying = default_standing_pose(robot)
    lying[3:7] = [np.cos(np.pi / 4), 0.0, np.sin(np.pi / 4), 0.0]
    heights = np.tile(lying, (400, 1))
    heights[:, 2] = np.linspace(0.0, 0.4, 400)
    found = detector.touches(heights)
    assert found.floor.any()
    assert found.distance.max() < 0.005
