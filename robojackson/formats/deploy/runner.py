"""Run this deploy pack in MuJoCo: python run.py [--seconds S] [--view]. Ctrl-C damps and stops.

Needs numpy and mujoco alone, and onnxruntime for a network. README.md has the interface of a robot.
"""

import argparse
import hashlib
import json
import signal
import sys
from pathlib import Path
from typing import Any

import mujoco
import mujoco.viewer
import numpy as np

from robojackson.formats.deploy.simulated_robot import SimulatedRobot

PARSER = argparse.ArgumentParser(description=__doc__)
PARSER.add_argument("--seconds", type=float, help="not given: the whole dance, at least 10 s")
PARSER.add_argument("--soft-start", type=float, default=3.0, help="seconds, hung up")
PARSER.add_argument("--view", action="store_true", help="MuJoCo's viewer, in real time")


def settings(folder: Path) -> dict[str, Any]:
    """Return the content of deploy.yaml."""
    lines = (folder / "deploy.yaml").read_text(encoding="utf-8").splitlines()
    pairs = (line.partition(": ") for line in lines if line and line[0] != "#")
    return {key: json.loads(value) for key, _, value in pairs}


class Runner:
    """The policy and its motion on a robot; refuses a pack whose parts do not fit each other."""

    machine: Any = SimulatedRobot
    files: tuple[str, ...] = ("deploy.yaml", "robot.xml", "policy.onnx", "motion.npz")

    def __init__(self, folder: Path = Path(__file__).parent, robot: Any = None) -> None:
        missing = [name for name in self.files if not (folder / name).is_file()]
        if missing:
            raise SystemExit(f"refused: {', '.join(missing)} missing in {folder}")
        self.cfg = cfg = settings(folder)
        self.model = mujoco.MjModel.from_xml_path(str(folder / "robot.xml"))
        self.pose = mujoco.MjData(self.model)
        self.robot: Any = robot or self.machine(self.model, cfg)
        keys = ("default_joint_pos", "stiffness", "damping")
        self.default, self.kp, self.kd = (np.array(cfg[key]) for key in keys)
        if self.robot.joints != cfg["joint_names"]:
            raise SystemExit(f"refused: the robot's joints are {self.robot.joints}")
        self.load(folder)

    def load(self, folder: Path) -> None:
        """Load network and motion."""
        import onnxruntime

        cfg, options = self.cfg, onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        self.session = onnxruntime.InferenceSession(str(folder / "policy.onnx"), options)
        motion = np.load(folder / "motion.npz")
        self.command = np.hstack([motion["joint_pos"], motion["joint_vel"]]).astype(float)
        poses = np.concatenate([motion["body_pos_w"], motion["body_quat_w"]], 2).astype(float)
        names, self.anchor = motion["body_names"].tolist(), cfg["anchor_body_name"]
        self.roots, self.anchors = poses[:, 0], poses[:, names.index(self.anchor), 3:]
        self.scale = np.array(cfg["action_scale"])
        self.begin(0)
        terms = {name: value.size for name, value in self.observe(*self.robot.read()).items()}
        layout = json.dumps([list(terms.items()), self.robot.joints, self.anchor])
        given = [hashlib.sha256(layout.encode()).hexdigest(), sum(terms.values())]
        made, size = self.session.get_modelmeta(), self.session.get_inputs()[0].shape[1]
        of_policy = [made.custom_metadata_map.get("observation_layout_sha256"), size]
        for file, expected in {"policy.onnx": of_policy, "deploy.yaml": cfg["layout"]}.items():
            if expected != given:
                raise SystemExit(f"refused: {file} is for {expected}, not for {given}: {terms}")

    def begin(self, row: int) -> None:
        """Start at a row of the motion, which is turned to where the robot faces."""
        self.row, self.tilt, self.action, turn = row, 0.0, np.zeros(len(self.default)), np.zeros(4)
        mujoco.mju_mulQuat(turn, self.robot.read()[0], self.roots[row, 3:] * [1, -1, -1, -1])
        self.turn = turn * [1, 0, 0, 1] / np.hypot(turn[0], turn[3])

    def observe(self, quat: Any, gyro: Any, angle: Any, rate: Any) -> dict[str, np.ndarray]:
        """Return the terms of the observation, in their order."""
        self.pose.qpos[:] = [0, 0, 0, *quat, *angle]
        mujoco.mj_kinematics(self.model, self.pose)
        target, there = np.zeros(4), np.zeros(9)
        mujoco.mju_mulQuat(target, self.turn, self.anchors[self.row])
        mujoco.mju_quat2Mat(there, target)
        apart = self.pose.body(self.anchor).xmat.reshape(3, 3).T @ there.reshape(3, 3)
        self.tilt = float(np.arccos(np.clip(apart[2, 2], -1, 1)))
        terms = {"command": self.command[self.row], "motion_anchor_ori_b": apart[:, :2].ravel()}
        terms |= {"base_ang_vel": gyro, "joint_pos": angle - self.default, "joint_vel": rate}
        return terms | {"actions": self.action}

    def act(self, *measured: Any) -> np.ndarray:
        """Return the network's targets at the row; no numbers where it is given none."""
        obs = np.concatenate(list(self.observe(*measured).values())).astype(np.float32)[None]
        feed = {"obs": obs, "time_step": np.full((1, 1), self.row, np.float32)}
        self.action = self.session.run(["actions"], feed)[0][0].astype(float)
        return np.asarray(self.default + self.scale * self.action + 0 * obs.sum())

    def row_of(self, step: int) -> int:
        """Return the row of a step: after the last one the first of a motion that repeats."""
        count = len(self.roots)
        return step % count if self.cfg["cyclic"] else min(step, count - 1)

    def step(self) -> str:
        """Run one control step towards the next row; return the reason for a stop, else nothing."""
        self.row = self.row_of(self.row + 1)
        measured = self.robot.read()
        return self.drive_or_stop(self.act(*measured), measured[3])

    def drive_or_stop(self, target: np.ndarray, rate: np.ndarray) -> str:
        """Drive the robot, unless it is lost; return the reason for a stop, else nothing."""
        fast = np.abs(rate) > 2 * np.array(self.cfg["limits"]["speed"])
        if self.tilt > self.cfg["stop_tilt"] or fast.any() or not np.isfinite(target).all():
            return f"leans {self.tilt:.2f} rad from the motion, {fast.sum()} joints too fast"
        self.robot.drive(target, self.kp, self.kd)
        return ""


def main(seconds: float | None, soft_start: float, view: bool, kind: type[Runner] = Runner) -> str:
    """Hang up, fade the gains in, move to the first pose, dance, damp; return why it ended."""
    runner, stop = kind(), list[str]()
    robot, dt = runner.robot, runner.cfg["step_dt"]
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.append("stopped by hand"))
    robot.data.qpos[:] = [*runner.roots[0], *runner.default]
    robot.viewer = mujoco.viewer.launch_passive(robot.model, robot.data) if view else None
    robot.hung, here = runner.roots[0], robot.read()[2]
    for share in np.linspace(0, 1, max(2, round(soft_start / dt))):
        goal = here + share * (runner.command[0, : len(here)] - here)
        if not stop:
            robot.drive(goal, min(1.0, 2 * share) * runner.kp, runner.kd)
    robot.hung, steps = None, 0
    runner.begin(0)
    seconds = max(10.0, len(runner.roots) * dt) if seconds is None else seconds
    try:
        while not stop and steps < round(seconds / dt):
            stop += filter(None, [runner.step()])
            steps += 1
    finally:
        for _ in range(round(2.0 / dt)):  # no stiffness: the joints only brake
            robot.drive(runner.default, 0.0 * runner.kp, runner.kd)
    return f"danced {steps * dt:.2f} s, then damped: {(*stop, 'the end')[0]}"


if __name__ == "__main__":
    sys.stdout.write(main(**vars(PARSER.parse_args())) + "\n")
