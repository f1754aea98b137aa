"""Laws of the bodies' orientations: those of MuJoCo, and an error that is a rotation's angle."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.geometry.rotations import from_rotation, quat_angle, quat_multiply
from robojackson.rl.modes.body_turns import body_turns, turn_error
from robojackson.robot.model import Robot

TURNED_LINK = """
<mujoco><worldbody><body><freejoint/><geom size=".1"/>
  <body quat=".8 .6 0 0"><geom size=".1"/>
    <body quat=".6 0 .8 0"><joint axis="0 .6 .8" ref="20"/><geom size=".1"/>
      <body><geom size=".1"/><body><joint axis="1 0 0"/><joint axis="0 1 0"/><geom size=".1"/>
</body></body></body></body></body></worldbody></mujoco>"""


@pytest.fixture(params=["humanoid", "links that are fixed to others"])
def model(request: pytest.FixtureRequest, robot: Robot) -> mujoco.MjModel:
    """Return a model with several hinges a body, or with turned bodies that have none."""
    if request.param == "humanoid":
        return robot.model
    return mujoco.MjModel.from_xml_string(TURNED_LINK)


def poses(model: mujoco.MjModel, count: int) -> np.ndarray:
    """Return random poses."""
    qpos = np.random.default_rng(4).normal(0.0, 0.5, (count, model.nq))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    return qpos


def test_orientations_are_those_of_mujoco(model: mujoco.MjModel) -> None:
    data, qpos = mujoco.MjData(model), poses(model, 5)
    bodies = np.unique(model.jnt_bodyid[1:])
    for pose, turns in zip(qpos, body_turns(model, qpos), strict=True):
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        assert quat_angle(turns, data.xquat[bodies]).max() < 1e-6


def test_the_error_of_a_turned_body_is_the_angle(model: mujoco.MjModel) -> None:
    qpos = poses(model, 3)
    turned = qpos.copy()
    turn = from_rotation(Rotation.from_rotvec([[0.1, 0.2, -0.2]]))
    turned[:, 3:7] = quat_multiply(np.repeat(turn, 3, 0), qpos[:, 3:7])
    np.testing.assert_allclose(turn_error(model, turned, qpos), 0.3, atol=1e-6)
    np.testing.assert_allclose(turn_error(model, qpos, qpos), 0.0, atol=1e-6)


def test_a_hinge_turns_the_bodies_after_it_alone(robot: Robot) -> None:
    qpos = poses(robot.model, 2)
    bent = qpos.copy()
    bent[:, 7:][:, robot.joint_names.index("right_elbow")] += 0.4
    angle = quat_angle(body_turns(robot.model, bent), body_turns(robot.model, qpos))
    np.testing.assert_allclose(angle.max(1), 0.4, atol=1e-6)
    assert ((angle > 1e-3).sum(1) == 1).all()
