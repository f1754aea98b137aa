"""A reference motion that only stands: for tasks without a motion, such as plain walking."""

import mujoco
import numpy as np

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.modes.reset_states import default_standing_pose
from robojackson.robot.model import Robot

STEPS = 20


def make_standing_motion(robot: Robot) -> ReferenceMotion:
    """Return the default stand, held, cyclic."""
    model, dt = robot.model, robot.description.control_dt
    data = mujoco.MjData(model)
    data.qpos[:] = default_standing_pose(robot)
    mujoco.mj_kinematics(model, data)

    def held(value: object) -> np.ndarray:
        return np.repeat(np.asarray(value, float)[None], STEPS, 0)

    return ReferenceMotion(
        robot=robot.description.name,
        model_sha256=robot.sha256,
        dt=dt,
        cyclic=True,
        cycle_offset=np.zeros(3),
        qpos=held(data.qpos),
        qvel=np.zeros((STEPS, model.nv)),
        body_pos_w=held(data.xpos[1:]),
        keypoints_w=held(data.site_xpos[robot.keypoint_sites]),
        contact=np.ones((STEPS, len(robot.contact_names)), np.int8),
        torque_ratio=np.zeros((STEPS, model.nq - 7)),
        source_time_s=np.arange(STEPS) * dt,
        joint_names=robot.joint_names,
        body_names=robot.body_names,
        keypoint_names=robot.keypoint_names,
        contact_names=robot.contact_names,
    )
