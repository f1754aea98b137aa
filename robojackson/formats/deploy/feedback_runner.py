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

Array = np.ndarray


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
        self.pose, self.robot = mujoco.MjData(self.model), robot or ImuRobot(self.model, cfg)
        self.robot.imu, self.rule, self.dt = np.array(cfg["imu"]), cfg["odometry"], cfg["step_dt"]
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
        self.place, self.swing = np.zeros(3), None

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
        now, ahead, measured = self.at(self.row), self.at(self.row + 1), self.robot.read()
        self.row, limit, apart = self.row + 1, self.cfg["feedback_limit"], np.zeros(self.model.nv)
        qpos, qvel = self.estimate(ahead, *measured)
        mujoco.mj_differentiatePos(self.model, apart, 1.0, now["path_qpos"], qpos)
        feet, _, shares = self.points("feet", qpos, qvel, self.rule["foot_low"])
        apart[:2] -= shares @ (feet - now["places"])[:, :2]
        moved = now["gain"] @ [*apart, *(qvel - now["path_qvel"])] + now["offset"]
        target = ahead["targets"] - np.clip(moved, np.negative(limit), limit)
        fast = np.abs(measured[3]) > 2 * np.array(self.cfg["limits"]["speed"])
        if self.tilt > self.cfg["stop_tilt"] or fast.any() or not np.isfinite(target).all():
            return f"leans {self.tilt:.2f} rad from the motion, {fast.sum()} joints too fast"
        self.robot.drive(target, self.kp, self.kd)
        return ""

    def estimate(self, ahead: dict[str, Array], *measured: Array) -> tuple[Array, Array]:
        """Return position and velocity, with estimates of the root's."""
        rule, dt, turned, (quat, gyro, angle, rate) = self.rule, self.dt, np.zeros(4), measured
        mujoco.mju_mulQuat(turned, self.turn * [1, -1, -1, -1], quat)
        axes = matrix(turned)
        swing = axes @ np.cross(gyro, self.cfg["imu"])
        upright = (axes.T @ matrix(ahead["qpos"][3:7]))[2, 2]
        self.tilt = float(np.arccos(np.clip(upright, -1, 1)))
        qpos, qvel = np.array([0, 0, 0, *turned, *angle]), np.array([0, 0, 0, *gyro, *rate])
        aimed, sliding, _ = self.points("soles", ahead["qpos"], ahead["qvel"], rule["low"])
        sliding = np.where(aimed[:, 2:] < rule["near"], sliding, 0.0) * [1, 1, 0]
        soles, speeds, shares = self.points("soles", qpos, qvel, rule["low"])
        speed, felt, share = shares @ (sliding - speeds), ahead["qvel"][:3], 1.0
        if self.swing is None:
            self.place = ahead["qpos"][:3] - dt * felt
        else:
            felt = self.swing + dt * (axes @ self.robot.force() + self.model.opt.gravity) - swing
            share = rule["share"]
        velocity = corrected(felt, speed, share, rule["doubt_speed"])
        self.place = self.place + (0.0 if self.swing is None else dt) * velocity
        high = corrected(self.place[2:], -soles[:, 2].min(), rule["share"], rule["doubt_height"])
        self.place[2:], self.swing = high, velocity + swing
        qpos[:3], qvel[:3] = self.place, velocity
        return qpos, qvel

    def points(self, name: str, qpos: Array, qvel: Array, low: float) -> tuple[Array, Array, Array]:
        """Return the lowest points of balls, their speeds, and how much each of them carries."""
        self.pose.qpos[:], jacobian, found = qpos, np.zeros((3, self.model.nv)), []
        mujoco.mj_kinematics(self.model, self.pose)
        mujoco.mj_comPos(self.model, self.pose)
        for owner, place, radius in self.cfg[name]:
            body = self.pose.body(owner)
            centre = body.xpos + body.xmat.reshape(3, 3) @ place
            mujoco.mj_jac(self.model, self.pose, jacobian, None, centre, body.id)
            found.append((centre - [0, 0, radius], jacobian @ qvel))
        points, speeds = np.array(found).swapaxes(0, 1)
        shares = np.exp(-(points[:, 2] - points[:, 2].min()) / low)
        return points, speeds, shares / shares.sum()


def matrix(quat: Array) -> Array:
    """Return the rotation matrix."""
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, quat)
    return np.asarray(turn.reshape(3, 3))


def corrected(value: Array, measured: Array, share: float, doubt: float) -> Array:
    """Return a value moved to a measured one, by half of the share where that is `doubt` away."""
    apart = measured - value
    return np.asarray(value + share / (1 + (np.linalg.norm(apart) / doubt) ** 2) * apart)


if __name__ == "__main__":
    sys.stdout.write(main(**vars(PARSER.parse_args()), kind=Runner) + "\n")
