"""States from which a browser's physics is compared with ours."""

from dataclasses import replace

import numpy as np

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig, EvaluateConfig
from robojackson.rl.evaluation.controllers import (
    Evaluated,
    control_of,
    feedback_driver,
    sees_ahead,
    trained_driver,
)
from robojackson.rl.evaluation.rollouts import Driver, Starts
from robojackson.rl.evaluation.starts import starts_of
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.trackers.regulator_tracker import RegulatorTracker
from robojackson.robot.model import Robot

RECORDS = 20
"""Number of states."""
SUBSTEPS = 300
"""Substeps of each comparison."""


def shown_control(policy: Evaluated, robot: Robot) -> ControlConfig:
    """Return the control law of a live dance: of the tracker that estimates the root itself, the
    law of a training on such an estimate, which does the same."""
    control = control_of(policy, robot)
    if isinstance(policy, RegulatorTracker):
        return replace(control, root_state=policy.description.root_state)
    return control


def live_records(
    policy: Evaluated, reference: ReferenceMotion, robot: Robot
) -> list[dict[str, object]]:
    """Return noisy starts across the motion and the positions of the bodies `SUBSTEPS` later."""
    control = shown_control(policy, robot)
    clip = driven_clip(robot, reference, control, sees_ahead(policy))
    starts, _ = starts_of(robot, clip, EvaluateConfig(phases=RECORDS, resets=1))
    starts = Starts(starts.step[:RECORDS], starts.qpos[:RECORDS], starts.qvel[:RECORDS])
    driver, count = _driver(policy, robot, reference), len(starts.step)
    sim = Simulation(robot, driver.control, count)
    sim.place(np.arange(count), starts.qpos, starts.qvel)
    if sim.root_estimate is not None:
        sim.root_estimate.noise = 0.0  # a browser draws other numbers
    steps = SUBSTEPS // (sim.control.substeps or 1)
    last = np.zeros((count, robot.model.nu))
    for step in range(steps):
        following = clip.at(starts.step + step + 1)
        command = driver.command(sim, following, starts.step, last)
        last = np.clip((command - sim.reference_angles(following)) / sim.residual, -1, 1)
        sim.step(command)
    sim.close()
    return [
        {
            "step": int(starts.step[i]),
            "qpos": starts.qpos[i].tolist(),
            "qvel": starts.qvel[i].tolist(),
            "steps": steps,
            "places": sim.datas[i].xpos[1:].ravel().tolist(),
        }
        for i in range(count)
    ]


def _driver(policy: Evaluated, robot: Robot, reference: ReferenceMotion) -> Driver:
    """Return the driver that is compared; of feedback alone its law, whose estimate has no noise
    here."""
    if isinstance(policy, RegulatorTracker):
        return feedback_driver(shown_control(policy, robot))
    return trained_driver(policy, robot, reference)
