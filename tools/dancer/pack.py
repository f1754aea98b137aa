"""Pack the dancer's motions and its robot into one file, for a machine without RoboJackson.

    python -m tools.dancer.pack REFERENCES -o PACK.npz [--robot g1]

REFERENCES holds reference motions (`tools.dancer.library`); a captured one that the split file
(`benchmarks/learning/split.yaml`) does not list for training is refused. The model in the file has
no meshes and no sensors, and five of the seven capsules of each sole, which keep its outline:
keypoints are .05 mm beside the whole model's after a control step.
"""

import argparse
from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np

from benchmarks.learning.split import load_split
from robojackson import load_robot
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig, ResetConfig
from robojackson.rl.modes.reset_states import default_standing_pose
from robojackson.rl.modes.rewards import tracked_points
from robojackson.rl.sim import disturbances
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.motors import Motors, gains, residual_scale
from robojackson.robot.mjcf import described_spec, mjcf_path
from robojackson.robot.model import Robot
from tools.dancer.library import source_of
from tools.dancer.mirror import hinge_partners, partners

ACTION_FACTOR = 4.0
"""Full action of the dancer in full actions of the robot: a robot has to step after a push."""
CONTROL = ControlConfig(feedforward=1.0, feedback=0.0, action_factor=ACTION_FACTOR)
SENSORS = (
    disturbances.GYRO_NOISE, disturbances.ATTITUDE_NOISE,
    disturbances.HINGE_NOISE, disturbances.HINGE_SPEED_NOISE,
)  # fmt: skip
"""mjlab's noise of the sensors, in the order of `sight.Sight`."""
CAPTURED_WEIGHT = 3
"""How often robots begin in a second of a captured motion, of an invented one."""
MOST_ITERATIONS = 5
"""Of the solver: on a GPU all robots wait for the last one."""
INNER_CAPSULES = ("foot3", "foot5")
"""Parts of the names of the soles' capsules between the outer ones."""


def light_model(robot: Robot) -> mujoco.MjModel:
    """Return the model without meshes, sensors and the soles' inner capsules; masses stay."""
    spec = described_spec(robot.description, mjcf_path(robot.description))
    for geom in list(spec.geoms):
        visual = geom.contype == 0 and geom.conaffinity == 0
        if visual or any(part in geom.name for part in INNER_CAPSULES):
            spec.delete(geom)
    for one in [*spec.meshes, *spec.sensors]:
        spec.delete(one)
    spec.option.iterations = MOST_ITERATIONS
    return spec.compile()


def pack(robot: Robot, named: Mapping[str, ReferenceMotion]) -> dict[str, np.ndarray]:
    """Return the arrays of the file: motions one after the other, and the robot's constants."""
    names, motions, model = list(named), list(named.values()), light_model(robot)
    content = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    lengths = [len(motion) for motion in motions]
    leads = [lead_of(robot, motion, CONTROL) for motion in motions]
    kp, kd = gains(robot, CONTROL)
    motors = Motors.of(robot.model)
    partner, sign = hinge_partners(robot)
    points = tracked_points(robot.keypoint_names)
    motion_arrays = {
        "qpos": np.concatenate([np.asarray(motion.qpos) for motion in motions]),
        "qvel": np.concatenate([np.asarray(motion.qvel) for motion in motions]),
        "points": np.concatenate([np.asarray(motion.keypoints_w) for motion in motions]),
        "lead": np.concatenate([lead for lead in leads if lead is not None]),
        "offset": np.stack([motion.cycle_offset for motion in motions]),
    }
    constants = {
        "kp": kp, "kd": kd, "limit": motors.limit, "gear": motors.gear,
        "scale": residual_scale(robot, CONTROL), "rest": robot.standing[7:],
        "standing": default_standing_pose(robot), "root_height": robot.standing[2],
        "mirror_sign": sign, "dt": motions[0].dt, "reset": _reset_noise(),
        "push": disturbances.PUSH, "sensors": SENSORS,
    }  # fmt: skip
    counts = {
        "length": np.array(lengths), "cyclic": np.array([motion.cyclic for motion in motions]),
        "hinge": motors.hinge, "sites": np.array([model.site(robot.model.site(int(i)).name).id
                                                  for i in robot.keypoint_sites]),
        "mirror_hinge": partner, "mirror_point": partners(robot.keypoint_names),
        "pelvis": np.array(points.pelvis), "limbs": np.array(points.limbs),
        "feet": np.array(points.feet), "supports": np.unique(robot.contact_keypoints),
        "substeps": np.array(robot.substeps),
    }  # fmt: skip
    floats = {
        name: np.asarray(value, np.float32) for name, value in (motion_arrays | constants).items()
    }
    floats = {name: _rounded(value) for name, value in floats.items()}
    counts["weight"] = np.array([1 if "invented" in name else CAPTURED_WEIGHT for name in names])
    return {"model": content, "names": np.array(names), **floats, **counts}


def collection(folder: Path) -> dict[str, ReferenceMotion]:
    """Read the reference motions of a folder.

    Raises:
        ValueError: a captured one is not in the split's training list.
    """
    paths = sorted(folder.glob("*.parquet"))
    sources = [source_of(path.stem) for path in paths]
    load_split().require_trainable(name for name in sources if name is not None)
    return {path.stem: ReferenceMotion.load(path) for path in paths}


def _rounded(values: np.ndarray) -> np.ndarray:
    """Return the values to 16 binary digits, which take a quarter less of the file."""
    bits = np.ascontiguousarray(values).view(np.uint32) & np.uint32(0xFFFFFF00)
    return bits.view(np.float32).reshape(values.shape)


def _reset_noise() -> list[float]:
    reset = ResetConfig()
    return [reset.joint_noise, reset.joint_speed_noise, reset.root_speed_noise]


def main() -> None:
    """Write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("references", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--robot", default="g1")
    given = parser.parse_args()
    motions = collection(given.references)
    arrays = pack(load_robot(given.robot), motions)
    np.savez_compressed(given.out, **arrays)
    seconds = arrays["length"].sum() * arrays["dt"]
    size = given.out.stat().st_size / 1e6
    print(f"{given.out}: {len(motions)} motions, {seconds:.0f} s, {size:.1f} MB")


if __name__ == "__main__":
    main()
