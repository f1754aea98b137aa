"""Run this deploy pack in MuJoCo: python run.py [--seconds S] [--view]. Ctrl-C damps and stops.

Feedback along a motion, without a network; place and velocity of the root are estimated. Needs
numpy and mujoco alone. README.md describes the interface of a real robot.
"""

import hashlib
import sys
from pathlib import Path

import mujoco
import numpy as np

from robojackson.formats.deploy.runner import PARSER, main
from robojackson.formats.deploy.runner import Runner as NetworkRunner
from robojackson.formats.deploy.simulated_robot import SimulatedRobot
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

    machine = ImuRobot
    files: tuple[str, ...] = ("deploy.yaml", "robot.xml", "feedback.npz")

    def load(self, folder: Path) -> None:
        """Load gains and motion."""
        if not callable(getattr(self.robot, "force", None)):
            raise SystemExit("refused: the robot has no force(), which is its accelerometer")
        self.robot.imu = np.array(self.cfg["imu"])
        if (
            hashlib.sha256((folder / "feedback.npz").read_bytes()).hexdigest()
            != self.cfg["feedback"]
        ):
            raise SystemExit("refused: feedback.npz is not the one of deploy.yaml")
        with np.load(folder / "feedback.npz") as arrays:
            self.rows = {name: arrays[name].astype(float) for name in arrays.files}
        self.roots, self.command = self.rows["qpos"][:, :7], self.rows["qpos"][:, 7:]
        self.begin(0)

    def begin(self, row: int) -> None:
        """Start at a row of the motion, which is turned to where the robot faces."""
        super().begin(row)
        self.passed, self.state = row, StateEstimator(self.model, self.cfg)

    def at(self, step: int) -> dict[str, Array]:
        """Return the motion and its feedback at a step; one that repeats travels on."""
        row = self.row_of(step)
        cycle = (step - row) // len(self.roots) if self.cfg["cyclic"] else 0
        found = {name: value[row].copy() for name, value in self.rows.items()}
        for place in (found["qpos"][:3], found["path_qpos"][:3], found["places"]):
            place += cycle * np.array(self.cfg["cycle_offset"])
        return found

    def aimed(self, ahead: dict[str, Array], *measured: Array) -> Array:
        """Return the targets that the feedback moves."""
        return ahead["targets"]

    def step(self) -> str:
        """Run one control step towards the next row; return the reason for a stop, else nothing."""
        now, ahead = self.at(self.passed), self.at(self.passed + 1)
        self.passed += 1
        self.row = self.row_of(self.passed)
        measured = quat, gyro, angle, rate = self.robot.read()
        target = self.aimed(ahead, *measured)
        turned, apart, limit = np.zeros(4), np.zeros(self.model.nv), self.cfg["feedback_limit"]
        mujoco.mju_mulQuat(turned, self.turn * [1, -1, -1, -1], quat)
        upright = (matrix(turned).T @ matrix(ahead["qpos"][3:7]))[2, 2]
        self.tilt = float(np.arccos(np.clip(upright, -1, 1)))
        qpos, qvel = np.array([0, 0, 0, *turned, *angle]), np.array([0, 0, 0, *gyro, *rate])
        qpos, qvel = self.state.estimate(now, qpos, qvel, self.robot.force())
        mujoco.mj_differentiatePos(self.model, apart, 1.0, now["path_qpos"], qpos)
        feet, _, shares = self.state.points("feet", qpos, qvel, self.cfg["odometry"]["foot_low"])
        apart[:2] -= shares @ (feet - now["places"])[:, :2]
        moved = now["gain"] @ [*apart, *(qvel - now["path_qvel"])] + now["offset"]
        return self.drive_or_stop(target - np.clip(moved, np.negative(limit), limit), rate)


if __name__ == "__main__":
    sys.stdout.write(main(**vars(PARSER.parse_args()), kind=Runner) + "\n")
