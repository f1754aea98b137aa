"""Run this deploy pack in MuJoCo: python run.py [--seconds S] [--view]. Ctrl-C damps and stops.

Feedback along a motion, without a network; place and velocity of the root are estimated. Needs
numpy and mujoco alone. README.md describes the interface of a real robot.
"""

import hashlib
import json
import sys
from pathlib import Path

import mujoco
import numpy as np

from robojackson.formats.deploy.runner import PARSER, SimulatedRobot, main
from robojackson.formats.deploy.runner import Runner as NetworkRunner
from robojackson.formats.deploy.state_estimator import StateEstimator, matrix

Array = np.ndarray
PARSER.description = __doc__


class ImuRobot(SimulatedRobot):
    """MuJoCo's robot with an accelerometer."""

    before, imu, noise, rng = np.zeros(3), np.zeros(3), 0.1, np.random.default_rng()

    def drive(self, target: Array, stiffness: Array, damping: Array) -> None:
        """Run one control step."""
        self.before = self.speed()
        super().drive(target, stiffness, damping)

    def speed(self) -> Array:
        """Return the velocity of the accelerometer, world."""
        swing = matrix(self.data.qpos[3:7]) @ np.cross(self.data.qvel[3:6], self.imu)
        return np.asarray(self.data.qvel[:3] + swing)

    def force(self) -> Array:
        """Return the accelerometer, mean over the last control step, axes of the root, m/s^2."""
        change = (self.speed() - self.before) / (self.substeps * self.model.opt.timestep)
        shown = matrix(self.data.qpos[3:7]).T @ (change - self.model.opt.gravity)
        return np.asarray(shown + self.noise * self.rng.standard_normal(3))


class Runner(NetworkRunner):
    """The feedback and its motion, in the frame of the motion; refuses parts that do not fit."""

    def __init__(self, folder: Path = Path(__file__).parent, robot: ImuRobot | None = None) -> None:
        lines = (folder / "deploy.yaml").read_text(encoding="utf-8").splitlines()
        pairs = (line.partition(": ") for line in lines if line and line[0] != "#")
        self.cfg = cfg = {key: json.loads(value) for key, _, value in pairs}
        self.model = mujoco.MjModel.from_xml_path(str(folder / "robot.xml"))
        machine = robot or ImuRobot(self.model, cfg)
        machine.imu, self.force = np.array(cfg["imu"]), machine.force
        self.pose, self.robot = mujoco.MjData(self.model), machine
        keys = ("default_joint_pos", "stiffness", "damping")
        self.default, self.kp, self.kd = (np.array(cfg[key]) for key in keys)
        if self.robot.joints != cfg["joint_names"]:
            raise SystemExit(f"refused: the robot's joints are {self.robot.joints}")
        if hashlib.sha256((folder / "feedback.npz").read_bytes()).hexdigest() != cfg["feedback"]:
            raise SystemExit("refused: feedback.npz is not the one of deploy.yaml")
        with np.load(folder / "feedback.npz") as arrays:
            self.rows = {name: arrays[name].astype(float) for name in arrays.files}
        self.roots, self.command = self.rows["qpos"][:, :7], self.rows["qpos"][:, 7:]
        self.begin(0)

    def begin(self, row: int) -> None:
        """Start at a row of the motion, which is turned to where the robot faces."""
        super().begin(row)
        self.state = StateEstimator(self.model, self.cfg)

    def at(self, step: int) -> dict[str, Array]:
        """Return the motion and its feedback at a step; one that repeats travels on."""
        count = len(self.roots)
        cycle, row = divmod(step, count) if self.cfg["cyclic"] else (0, min(step, count - 1))
        found = {name: value[row].copy() for name, value in self.rows.items()}
        for place in (found["qpos"][:3], found["path_qpos"][:3], found["places"]):
            place += cycle * np.array(self.cfg["cycle_offset"])
        return found

    def step(self) -> str:
        """Run one control step towards the next row; return the reason for a stop, else nothing."""
        now, ahead = self.at(self.row), self.at(self.row + 1)
        quat, gyro, angle, rate = self.robot.read()
        turned, apart, limit = np.zeros(4), np.zeros(self.model.nv), self.cfg["feedback_limit"]
        mujoco.mju_mulQuat(turned, self.turn * [1, -1, -1, -1], quat)
        upright = (matrix(turned).T @ matrix(ahead["qpos"][3:7]))[2, 2]
        self.row, self.tilt = self.row + 1, float(np.arccos(np.clip(upright, -1, 1)))
        qpos, qvel = np.array([0, 0, 0, *turned, *angle]), np.array([0, 0, 0, *gyro, *rate])
        qpos, qvel = self.state.estimate(ahead, qpos, qvel, self.force())
        mujoco.mj_differentiatePos(self.model, apart, 1.0, now["path_qpos"], qpos)
        feet, _, shares = self.state.points("feet", qpos, qvel, self.cfg["odometry"]["foot_low"])
        apart[:2] -= shares @ (feet - now["places"])[:, :2]
        moved = now["gain"] @ [*apart, *(qvel - now["path_qvel"])] + now["offset"]
        target = ahead["targets"] - np.clip(moved, np.negative(limit), limit)
        return self.drive_or_stop(target, rate)

    def drive_or_stop(self, target: Array, rate: Array) -> str:
        """Drive the robot, unless it is lost; return the reason for a stop, else nothing."""
        fast = np.abs(rate) > 2 * np.array(self.cfg["limits"]["speed"])
        if self.tilt > self.cfg["stop_tilt"] or fast.any() or not np.isfinite(target).all():
            return f"leans {self.tilt:.2f} rad from the motion, {fast.sum()} joints too fast"
        self.robot.drive(target, self.kp, self.kd)
        return ""


if __name__ == "__main__":
    sys.stdout.write(main(**vars(PARSER.parse_args()), kind=Runner) + "\n")
