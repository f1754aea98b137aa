"""Controllers of an evaluation: the policy, and baselines that do not dance."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from pydantic import PositiveInt

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.evaluate_config import HOLD, REGULATOR, TRAINED
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.evaluation.rollouts import Driver
from robojackson.rl.evaluation.tracker_driver import tracker_driver
from robojackson.rl.modes.observation import AHEAD, Observer
from robojackson.rl.policy import Policy
from robojackson.rl.policy_facts import fact, observation_of, policy_control
from robojackson.rl.sim.motors import Motors, residual_scale
from robojackson.rl.sim.reference_clip import ClipStep
from robojackson.rl.sim.simulation import Simulation, resolved
from robojackson.rl.sim.stock_humanoid import stock_observation
from robojackson.rl.trackers.tracker import Tracker
from robojackson.robot.model import Robot

Evaluated = Policy | Tracker
"""A policy trained on a motion, or a tracker of any motion."""
Command = Callable[[Simulation, ClipStep, np.ndarray, np.ndarray], np.ndarray]


def equipped(policy: Evaluated, robot: Robot) -> Robot:
    """Return the robot with the gains of a tracker; the robot itself for a policy.

    Raises:
        BadPolicy: the tracker is for another robot.
    """
    return robot if isinstance(policy, Policy) else policy.equip(robot)


def control_of(policy: Evaluated, robot: Robot) -> ControlConfig:
    """Return the control law that a policy or a tracker was trained with.

    Raises:
        BadPolicy: the policy was trained for another robot, or its file has no control law.
    """
    return policy_control(policy, robot) if isinstance(policy, Policy) else policy.control


def drivers(
    policy: Evaluated, reference: ReferenceMotion, robot: Robot, seed: int
) -> dict[str, Driver]:
    """Return the policy, its variants and the baselines by name; each baseline uses the PD law."""
    control = control_of(policy, robot)
    found = {TRAINED: trained_driver(policy, robot, reference)}
    if control.law == "pd" and isinstance(policy, Policy):
        found[HOLD] = replace(found[TRAINED], control=replace(control, law="hold"))
        if resolved(control, robot).feedback:
            found[REGULATOR] = feedback_driver(control)
    usual = control if control.law == "pd" else ControlConfig(substeps=control.substeps)
    return found | _baselines(reference, robot, replace(usual, feedback=0.0), seed)


def trained_driver(policy: Evaluated, robot: Robot, reference: ReferenceMotion) -> Driver:
    """Return the driver of a trained policy, or of a tracker.

    Raises:
        BadPolicy: it was trained for another robot.
    """
    if not isinstance(policy, Policy):
        return tracker_driver(policy, robot, reference)
    return _trained(policy, robot, control_of(policy, robot))


def feedback_driver(control: ControlConfig) -> Driver:
    """Return the driver of a control law alone: of its feedback, without a network."""
    return Driver(control, _follow)


def _trained(policy: Policy, robot: Robot, control: ControlConfig) -> Driver:
    if control.law == "torque":
        most = robot.model.actuator_ctrlrange[:, 1]

        def torque(
            sim: Simulation, following: ClipStep, start: np.ndarray, last: np.ndarray
        ) -> np.ndarray:
            result: np.ndarray = most * policy.act(
                stock_observation(sim)[:, : policy.observation_size]
            )
            return result

        repeats = fact(policy, "repeats", PositiveInt) if "repeats" in policy.facts else 1
        return Driver(control, torque, repeats)

    observer = Observer(robot, observation_of(policy))

    def target(
        sim: Simulation, following: ClipStep, start: np.ndarray, last: np.ndarray
    ) -> np.ndarray:
        seen = observer.observe(*sim.sensed(), sim.points, following, last)
        action = policy.act(seen[:, : observer.actor_size])
        result: np.ndarray = sim.reference_angles(following) + sim.residual * action
        return result

    return Driver(control, target)


def _baselines(
    reference: ReferenceMotion, robot: Robot, control: ControlConfig, seed: int
) -> dict[str, Driver]:
    hinge = Motors.of(robot.model).hinge
    scale = residual_scale(robot, control)
    rng = np.random.default_rng(seed)
    poses = np.asarray(reference.qpos, float)[:, 7:][:, hinge]
    commands: dict[str, Command] = {
        "statue": lambda sim, following, start, last: poses[start % len(poses)],
        "mean_pose": lambda sim, following, start, last: np.repeat(
            poses.mean(0, keepdims=True), sim.n, 0
        ),
        "zero_residual": _follow,
        "random": lambda sim, following, start, last: (
            sim.reference_angles(following) + scale * rng.uniform(-1, 1, (sim.n, len(hinge)))
        ),
    }
    return {name: Driver(control, command) for name, command in commands.items()}


def _follow(
    sim: Simulation, following: ClipStep, start: np.ndarray, last: np.ndarray
) -> np.ndarray:
    """Return the command of the control law without a policy."""
    return sim.reference_angles(following)


def sees_ahead(policy: Evaluated) -> bool:
    """Return whether a policy takes a preview of the reference."""
    if not isinstance(policy, Policy):
        return policy.sees_ahead
    return observation_of(policy) in AHEAD
