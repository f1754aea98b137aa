"""holosoma's dancing policies (PyPI holosoma-inference 0.1.3) as trackers of their own motion.

Each is an ONNX file with the network, the gains and the motion inside it (about 132 s at 50 Hz).
Inputs, 154 numbers, their terms in alphabetical order: last action (29), angular velocity (3),
joint angles minus the default ones (29), joint speeds (29), the motion's joint angles and speeds
(58), the first two columns of the motion's torso orientation in the robot's (6). Target angles are
the default ones plus the action: in radians where the graph scales it (FastSAC), else times a
quarter of effort limit over gain (PPO). Radians, seconds.
"""

import json
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import onnx
from jaxtyping import Float
from onnx import numpy_helper
from onnxruntime import InferenceSession
from scipy.spatial.transform import Rotation

from robojackson.geometry.rotations import from_rotation, to_rotation
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.sim.motors import Motors
from robojackson.rl.trackers.tracker import TrackerInput
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.model import Robot
from robojackson.robot.resampling import velocities
from robojackson.robot.tree_kinematics import continuous, pose, tree

LEG, ARM = [-0.312, 0.0, 0.0, 0.669, -0.363, 0.0], [0.2, 0.2, 0.0, 0.6, 0.0, 0.0, 0.0]
DEFAULT = np.array([*LEG, *LEG, 0.0, 0.0, 0.0, *ARM, *(np.array([1, -1, 1, 1, 1, 1, 1]) * ARM)])
WAIST, ACTION_SHARE, CLIP, DT = slice(12, 15), 0.25, 100.0, 0.02
ARRAYS = {"joint_pos": 29, "joint_vel": 29, "torso": 3, "torso_xyzw": 4}
"""Width of the motion's arrays, in the order of the graph's constants."""


class HolosomaPolicy:
    """One of the two policies (`Tracker` protocol).

    Args:
        kind: `fastsac` or `ppo`.
        path: ONNX file of the policy.
    """

    def __init__(self, kind: str, path: Path) -> None:
        model = onnx.load(str(path))
        facts = {entry.key: entry.value for entry in model.metadata_props}
        self.names = json.loads(facts["dof_names"])
        self.kp, self.kd = (np.array(json.loads(facts[key])) for key in ("kp", "kd"))
        self.in_radians = any(t.name.endswith("action_scale") for t in model.graph.initializer)
        values = (numpy_helper.to_array(node.attribute[0].t) for node in model.graph.node
                  if node.op_type == "Constant")  # fmt: skip
        long = [np.asarray(value, float) for value in values if value.ndim == 2]
        self.motion = dict(zip(ARRAYS, (v for v in long if len(v) > CLIP), strict=True))
        self.session = InferenceSession(path.read_bytes(), providers=["CPUExecutionProvider"])
        self.description = TrackerDescription(
            name=f"holosoma_{kind}", robot="g1", network="regulator", licence="Apache-2.0",
            trained_on="the motion that it dances", homepage="https://github.com/amazon-far/holosoma",
            control_dt=DT,
        )  # fmt: skip
        self.window: tuple[int, ...] = (0,)
        self.control = ControlConfig(feedforward=0.0, feedback=0.0)
        self.sees_ahead = self.sees_travel = False

    def equip(self, robot: Robot) -> Robot:
        """Return the robot with its gains."""
        if tuple(self.names) != robot.joint_names:
            raise SystemExit("holosoma's joints are not the robot's")
        gains = replace(robot.actuation, stiffness=self.kp, damping=self.kd)
        return replace(robot, actuation=gains)

    def follow(self, robot: Robot, n: int) -> "_Follower":
        """Begin with n robots."""
        return _Follower(self, robot, n)

    def reference(self, robot: Robot, first: int, steps: int) -> ReferenceMotion:
        """Return a part of its motion."""
        part = {name: array[first : first + steps] for name, array in self.motion.items()}
        waist = _waist(part["joint_pos"][:, WAIST])
        torso = Rotation.from_quat(part["torso_xyzw"])
        root, data = torso * waist.inv(), mujoco.MjData(robot.model)
        offset = []
        for angles in part["joint_pos"]:
            data.qpos[:] = 0.0
            data.qpos[3], data.qpos[7:] = 1.0, angles
            mujoco.mj_kinematics(robot.model, data)
            offset.append(data.body("torso_link").xpos.copy())
        place = part["torso"] - root.apply(np.array(offset))
        qpos = continuous(np.concatenate([place, from_rotation(root), part["joint_pos"]], 1))
        posed, count = pose(tree(robot), qpos), len(qpos)
        return ReferenceMotion(
            robot=robot.description.name, model_sha256=robot.sha256, dt=DT, cyclic=False,
            cycle_offset=np.zeros(3), qpos=qpos, qvel=velocities(qpos, DT, None),
            body_pos_w=posed.body_pos[:, 1:], keypoints_w=posed.site_pos,
            contact=np.ones((count, len(robot.contact_names)), int),
            torque_ratio=np.zeros((count, len(robot.joint_names))),
            source_time_s=np.arange(count) * DT, joint_names=robot.joint_names,
            body_names=robot.body_names, keypoint_names=robot.keypoint_names,
            contact_names=robot.contact_names,
        )  # fmt: skip


class _Follower:
    """N robots with the last action of each."""

    def __init__(self, policy: HolosomaPolicy, robot: Robot, n: int) -> None:
        self._session, motors = policy.session, Motors.of(robot.model)
        self._hinge = motors.hinge
        limit = motors.limit[np.argsort(motors.hinge)]
        self._scale = np.where(policy.in_radians, 1.0, ACTION_SHARE * limit / policy.kp)
        self._action = np.zeros((n, len(DEFAULT)))

    def targets(self, seen: TrackerInput) -> Float[np.ndarray, "N nu"]:
        (now,) = seen.window
        robots, goal = (
            to_rotation(qpos[:, 3:7]) * _waist(qpos[:, 7:][:, WAIST])
            for qpos in (seen.qpos, now.qpos)
        )
        apart = (robots.inv() * goal).as_matrix()[:, :, :2].reshape(-1, 6)
        inputs = [self._action, seen.qvel[:, 3:6], seen.qpos[:, 7:] - DEFAULT, seen.qvel[:, 6:],
                  now.qpos[:, 7:], now.qvel[:, 6:], apart]  # fmt: skip
        rows = np.concatenate(inputs, 1).astype(np.float32)
        step = np.zeros((1, 1), np.float32)
        found = [self._session.run(["actions"], {"obs": row[None], "time_step": step})[0][0]
                 for row in rows]  # fmt: skip
        self._action = np.clip(np.array(found, float), -CLIP, CLIP)
        return (DEFAULT + self._scale * self._action)[:, self._hinge]


def _waist(angles: Float[np.ndarray, "N 3"]) -> Rotation:
    """Return the torso's orientation in the pelvis', from yaw, roll and pitch of the waist."""
    return Rotation.from_euler("ZXY", angles)
