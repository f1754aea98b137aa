"""A body that is fixed to the world is no part of the robot."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from robojackson.report.plots.robot_sheet import BESIDE, PIXELS, VIEWS, framing_of, standing
from robojackson.report.video.panel_camera import view_of
from robojackson.report.video.robot_scene import dressed
from robojackson.retarget.feasibility.certification import certify
from robojackson.retarget.feasibility.contact_wrench import Tolerance
from robojackson.retarget.feasibility.inverse_dynamics import body_weight
from robojackson.retarget.solver.collision import Detector
from robojackson.rl.modes.reset_states import default_standing_pose
from robojackson.rl.sim.robot_batch import centre_of_mass as simulated_centre
from robojackson.robot.body_states import drawn_geoms, shown_rgba
from robojackson.robot.model import Robot, load_robot
from robojackson.robot.tree_kinematics import centre_of_mass, point_jacobian, pose, tree
from tests.fixtures.own_robot import UNTOUCHED, described_on, gymnasium_model
from tests.fixtures.robots import description

STAGE = (
    '<body name="stage" pos="0 0 -.2"><geom type="box" size="3 3 .2"/>'
    '<body name="marker" pos="0 0 -1"><geom size=".1" mass="5"/></body></body>'
)


@pytest.fixture
def on_stage(tmp_path: Path) -> Robot:
    """Return Humanoid-v5 on a slab of several tonnes whose upper side is the floor."""
    text = gymnasium_model().read_text()
    (tmp_path / "model.xml").write_text(text.replace("<worldbody>", f"<worldbody>{STAGE}"))
    return load_robot(replace(description(), mjcf=str(tmp_path / "model.xml")))


def test_the_mass_and_its_centre_are_those_of_mujocos_subtree(on_stage: Robot) -> None:
    model, data = on_stage.model, mujoco.MjData(on_stage.model)
    root = model.body("torso").id
    data.qpos[:] = on_stage.standing
    data.qpos[0] += 1.0
    mujoco.mj_forward(model, data)
    assert model.body_mass.sum() > 1000.0
    shape = tree(on_stage)
    found = centre_of_mass(shape, pose(shape, data.qpos[None]))[0]
    np.testing.assert_allclose(found, data.subtree_com[root], atol=1e-9)
    np.testing.assert_allclose(simulated_centre(model, data), data.subtree_com[root], atol=1e-9)
    assert body_weight(on_stage) == pytest.approx(9.81 * model.body_subtreemass[root])
    assert f"{model.body_subtreemass[root]:.1f} kg" in repr(on_stage)


def test_no_hinge_and_no_root_moves_it(on_stage: Robot) -> None:
    model, shape = on_stage.model, tree(on_stage)
    bodies = np.array([model.body(name).id for name in ("stage", "marker")])
    points = np.ones((1, 2, 3))
    found = point_jacobian(shape, pose(shape, on_stage.standing[None]), points, bodies)
    np.testing.assert_array_equal(found, 0.0)


def test_the_robot_stands_and_leans_as_without_it(robot: Robot, on_stage: Robot) -> None:
    stand = default_standing_pose(robot)
    np.testing.assert_allclose(default_standing_pose(on_stage), stand, atol=1e-12)
    leaning = np.repeat(stand[None], 8, 0)
    leaning[:, 3], leaning[:, 4] = np.cos(0.175), np.sin(0.175)
    bare, staged = (
        certify(each, leaning, 0.015, None, Tolerance()).certificate.slack
        for each in (robot, on_stage)
    )
    assert bare[4] > 1.0, "nothing holds a body that leans beside its feet"
    np.testing.assert_allclose(staged, bare, rtol=1e-6)


def test_what_is_fixed_to_the_world_is_floor(on_stage: Robot) -> None:
    stand = default_standing_pose(on_stage)[None]
    touches = Detector(on_stage, 0.01).touches(stand)
    assert len(touches.floor) >= 4, "each foot touches the plane and the slab"
    assert touches.floor.all()
    assert not Detector(on_stage, 0.01, feet=False).touches(stand).floor.any()


PROPS = (
    '<body name="wall" pos="-3 0 1.5"><geom type="box" size=".1 4 1.5"/></body>'
    '<body name="ground"><geom type="plane" size="20 20 .1"/></body>'
)


def test_only_the_robot_is_drawn_and_measured(robot: Robot, tmp_path: Path) -> None:
    crowded = load_robot(described_on(tmp_path, ("<worldbody>", f"<worldbody>{PROPS}")))
    bodies = [
        robot.model.body(body).name for body in robot.model.geom_bodyid[drawn_geoms(robot.model)]
    ]
    found = [
        crowded.model.body(b).name for b in crowded.model.geom_bodyid[drawn_geoms(crowded.model)]
    ]
    assert found == bodies
    assert {"wall", "ground", "world"}.isdisjoint(found)
    alone, beside = standing(robot), standing(crowded)
    np.testing.assert_allclose([beside.low, beside.high], [alone.low, alone.high])


def test_what_a_material_hides_is_not_drawn(robot: Robot, tmp_path: Path) -> None:
    bubble = f'<geom name="bubble" size=".6" material="ghost" mass="0" {UNTOUCHED}/>'
    changes = ("<asset>", '<asset><material name="ghost" rgba="1 0 0 0"/>')
    for colour, is_drawn in ((' rgba=".5 .5 .5 1"', False), (' rgba=".5 .5 .4 1"', True)):
        own = bubble.replace("/>", f"{colour}/>")
        hidden = load_robot(
            described_on(tmp_path, changes, ('<geom name="head"', f'{own}<geom name="head"'))
        )
        assert (hidden.model.geom("bubble").id in drawn_geoms(hidden.model)) == is_drawn
        assert (standing(hidden).high[2] > standing(robot).high[2] + 0.3) == is_drawn
        painted = dressed(hidden.model, 64, 64, (1.0, 0.0, 0.0))
        assert painted.geom_rgba[hidden.model.geom("bubble").id, 3] == is_drawn


def test_colours_are_those_of_mujocos_own_scene(tmp_path: Path) -> None:
    """A geom's own colour goes before its material's, but for MuJoCo's default grey."""
    changes = [
        ("<asset>", '<asset><material name="red" rgba="1 0 0 1"/>'),
        ('<geom name="head"', '<geom name="head" material="red" rgba=".1 .2 .3 1"'),
        ('name="butt"', 'name="butt" material="red" rgba=".5 .5 .5 1"'),
    ]
    model = load_robot(described_on(tmp_path, *changes)).model
    data, scene = mujoco.MjData(model), mujoco.MjvScene(model, 1000)
    mujoco.mj_forward(model, data)
    everything = mujoco.mjtCatBit.mjCAT_ALL.value
    camera, option = mujoco.MjvCamera(), mujoco.MjvOption()
    mujoco.mjv_updateScene(model, data, option, None, camera, everything, scene)
    kind = int(mujoco.mjtObj.mjOBJ_GEOM)
    drawn = {g.objid: g.rgba.copy() for g in scene.geoms[: scene.ngeom] if g.objtype == kind}
    for geom in drawn_geoms(model):
        np.testing.assert_allclose(shown_rgba(model)[geom], drawn[geom])
    np.testing.assert_allclose(drawn[model.geom("butt").id], [1, 0, 0, 1])
    np.testing.assert_allclose(drawn[model.geom("head").id], [0.1, 0.2, 0.3, 1], rtol=1e-6)


@pytest.mark.parametrize("scale", [0.3, 1.0, 1.5, 4.0])
def test_a_robot_of_any_height_fits_with_its_names_beside_it(scale: float, robot: Robot) -> None:
    pose = standing(robot)
    pose = replace(pose, low=scale * pose.low, high=scale * pose.high)
    at, tall = (pose.low[:2] + pose.high[:2]) / 2, pose.high[2] - pose.low[2]
    for _, azimuth in VIEWS:
        camera = view_of(at, azimuth, PIXELS, PIXELS, framing_of(pose))
        ends = np.array(np.meshgrid(*zip(pose.low, pose.high, strict=True))).reshape(3, -1).T
        for aside in (-BESIDE, BESIDE):
            pixels = camera.project(ends + aside * tall * camera.axes[0])
            assert (pixels >= 0.0).all()
            assert (pixels <= PIXELS).all()
            if scale > 1.0:
                assert np.ptp(pixels[:, 1]) > 0.7 * PIXELS, (
                    "the robot is as large as the picture allows"
                )
