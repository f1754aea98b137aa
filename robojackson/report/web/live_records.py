"""States from which a browser's physics is compared with ours.

From some states a limb just touches, or just does not: there a ten-millionth decides, and one
MuJoCo differs from itself as it does from another version. Every state says by how much.
"""

import numpy as np
from jaxtyping import Float

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import EvaluateConfig
from robojackson.rl.evaluation.controllers import Evaluated, control_of, sees_ahead, trained_driver
from robojackson.rl.evaluation.rollouts import Driver, Starts
from robojackson.rl.evaluation.starts import starts_of
from robojackson.rl.sim.preview import driven_clip
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.robot.model import Robot

RECORDS = 20
"""Number of states."""
SUBSTEPS = 300
"""Substeps of each comparison."""
SHAKE_RAD = 1e-7
"""Noise of every hinge after each step: between MuJoCo 3.14 and 4.0 lies as much."""
SHAKES = 8


def live_records(
    policy: Evaluated, reference: ReferenceMotion, robot: Robot
) -> list[dict[str, object]]:
    """Return noisy starts across the motion, the positions of the bodies `SUBSTEPS` later, and how
    far (mm) `SHAKE_RAD` moves those."""
    clip = driven_clip(robot, reference, control_of(policy, robot), sees_ahead(policy))
    starts, _ = starts_of(robot, clip, EvaluateConfig(phases=RECORDS, resets=1))
    starts = Starts(starts.step[:RECORDS], starts.qpos[:RECORDS], starts.qvel[:RECORDS])
    driver = trained_driver(policy, robot, reference)
    steps = SUBSTEPS // (driver.control.substeps or robot.substeps)
    places = _places(robot, clip, driver, starts, steps, 0.0)
    apart = [
        np.linalg.norm(
            _places(robot, clip, driver, starts, steps, SHAKE_RAD, seed) - places, axis=-1
        )
        for seed in range(SHAKES)
    ]
    shaken_mm = 1000 * np.max(apart, axis=(0, 2))
    return [
        {
            "step": int(starts.step[i]),
            "qpos": starts.qpos[i].tolist(),
            "qvel": starts.qvel[i].tolist(),
            "steps": steps,
            "places": places[i].ravel().tolist(),
            "shaken": round(float(shaken_mm[i]), 3),
        }
        for i in range(len(starts.step))
    ]


def _places(
    robot: Robot,
    clip: Clip,
    driver: Driver,
    starts: Starts,
    steps: int,
    noise: float,
    seed: int = 0,
) -> Float[np.ndarray, "N B 3"]:
    """Return where the bodies are after a number of steps."""
    rng, count = np.random.default_rng(seed), len(starts.step)
    sim = Simulation(robot, driver.control, count)
    sim.place(np.arange(count), starts.qpos, starts.qvel)
    last = np.zeros((count, robot.model.nu))
    for step in range(steps):
        following = clip.at(starts.step + step + 1)
        command = driver.command(sim, following, starts.step, last)
        last = np.clip((command - sim.reference_angles(following)) / sim.residual, -1, 1)
        sim.step(command)
        for data in sim.datas if noise else []:
            data.qpos[7:] += noise * rng.uniform(-1, 1, len(data.qpos) - 7)
    sim.close()
    return np.array([data.xpos[1:] for data in sim.datas])
