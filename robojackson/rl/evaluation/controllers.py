"""Who drives a robot when a policy is judged: the policy, and those that do not dance beside it."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TypeVar, get_args

import numpy as np
from pydantic import PositiveInt, TypeAdapter, ValidationError

from robojackson.errors import BadPolicy
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.evaluate_config import TRAINED
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.evaluation.rollouts import Driver
from robojackson.rl.evaluation.tracker_driver import CONTROL, tracker_driver
from robojackson.rl.modes.observation import Kind, Observer
from robojackson.rl.policy import Policy
from robojackson.rl.sim.motors import Motors, actuation_facts, residual_scale
from robojackson.rl.sim.reference_clip import ClipStep
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.sim.stock_humanoid import stock_observation, stock_observation_size
from robojackson.rl.trackers.tracker import Tracker
from robojackson.robot.model import Robot

T = TypeVar("T")
Evaluated = Policy | Tracker
"""Who may be evaluated: a policy that was trained on a motion, or a tracker of any."""
Command = Callable[[Simulation, ClipStep, np.ndarray, np.ndarray], np.ndarray]


def mode_of(policy: Policy) -> str:
    """`track` or `paper`."""
    return str(policy.facts.get("mode", "track"))


def equipped(policy: Evaluated, robot: Robot) -> Robot:
    """The robot with the gains of a tracker; itself for a policy.

    Raises:
        BadPolicy: the tracker is for another robot.
    """
    return robot if isinstance(policy, Policy) else policy.equip(robot)


def control_of(policy: Evaluated, robot: Robot) -> ControlConfig:
    """The control law that a policy was trained with; a tracker follows the PD law.

    Raises:
        BadPolicy: the policy was trained for another robot, or its file says no control law.
    """
    if not isinstance(policy, Policy):
        return CONTROL
    trained_for = policy.facts.get("robot", robot.description.name)
    if trained_for != robot.description.name:
        raise BadPolicy(
            f"the policy was trained for robot {trained_for!r}, not for {robot.description.name!r}"
        )
    if "control" not in policy.facts:
        raise BadPolicy("the policy's file says nothing of its control law")
    sizes = _observation_sizes(policy, robot)
    if policy.observation_size not in sizes:
        raise BadPolicy(
            f"the policy takes {policy.observation_size} observations and robot "
            f"{robot.description.name!r} gives {sizes[0]}: it was trained for another robot"
        )
    if policy.action_size != robot.model.nu:
        raise BadPolicy(
            f"the policy gives {policy.action_size} actions and robot {robot.description.name!r} "
            f"takes {robot.model.nu}: it was trained for another robot"
        )
    control = fact(policy, "control", ControlConfig)
    _require_same_actuation(policy, robot, control)
    return control


def _require_same_actuation(policy: Policy, robot: Robot, control: ControlConfig) -> None:
    """Refuse a robot whose gains or action scale have changed since the policy was trained.

    Raises:
        BadPolicy: naming the first motor that differs.
    """
    recorded = policy.facts.get("actuation")
    if mode_of(policy) != "track" or not isinstance(recorded, Mapping):
        return
    motors = [robot.joint_names[hinge] for hinge in Motors.of(robot.model).hinge]
    for name, now in actuation_facts(robot, control).items():
        then = np.asarray(recorded.get(name, now), float)
        if then.shape == (len(motors),) and np.allclose(then, now, rtol=1e-6):
            continue
        same_shape = then.shape == (len(motors),)
        worst = int(np.argmax(np.abs(then - now))) if same_shape else 0
        was = f"{then[worst]:g}" if same_shape else f"{then.size} numbers"
        raise BadPolicy(
            f"the policy was trained with {name} {was} of {motors[worst]} and robot "
            f"{robot.description.name!r} has {now[worst]:g} now: restore the robot's YAML or train "
            "anew"
        )


def fact(policy: Policy, name: str, kind: type[T]) -> T:
    """A configuration out of a policy's file.

    Raises:
        BadPolicy: it holds what this version does not know.
    """
    try:
        return TypeAdapter(kind).validate_python(policy.facts[name])
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, (name, *first["loc"])))
        raise BadPolicy(
            f"the policy's file says {where} = {first['input']!r} ({first['msg']}): it is of "
            "another version of RoboJackson; train it anew"
        ) from error


def drivers(
    policy: Evaluated, reference: ReferenceMotion, robot: Robot, seed: int
) -> dict[str, Driver]:
    """The policy, its variants and the baselines by name; each baseline follows the PD law."""
    control = control_of(policy, robot)
    found = {TRAINED: trained_driver(policy, robot, reference)}
    if control.law == "pd" and isinstance(policy, Policy):
        found["hold"] = replace(found[TRAINED], control=replace(control, law="hold"))
    usual = control if control.law == "pd" else ControlConfig(substeps=control.substeps)
    return found | _baselines(reference, robot, usual, seed)


def trained_driver(policy: Evaluated, robot: Robot, reference: ReferenceMotion) -> Driver:
    """The policy as it was trained, or the tracker.

    Raises:
        BadPolicy: it was trained for another robot.
    """
    if not isinstance(policy, Policy):
        return tracker_driver(policy, robot, reference)
    return _trained(policy, robot, control_of(policy, robot))


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
        "zero_residual": lambda sim, following, start, last: sim.reference_angles(following),
        "random": lambda sim, following, start, last: (
            sim.reference_angles(following) + scale * rng.uniform(-1, 1, (sim.n, len(hinge)))
        ),
    }
    return {name: Driver(control, command) for name, command in commands.items()}


def observation_of(policy: Policy) -> Kind:
    """Which inputs a policy of mode `track` takes."""
    held = policy.facts.get("environment")
    said = held.get("observation", "full") if isinstance(held, Mapping) else "full"
    kinds: dict[object, Kind] = {kind: kind for kind in get_args(Kind)}
    return kinds.get(said, "full")


def sees_ahead(policy: Evaluated) -> bool:
    """Whether a policy takes a preview of the reference."""
    return isinstance(policy, Policy) and observation_of(policy) == "preview"


def _observation_sizes(policy: Policy, robot: Robot) -> tuple[int, ...]:
    """Lengths of the observations that a policy may take."""
    model = robot.model
    if mode_of(policy) == "paper":
        joints = model.nq - 2 + model.nv
        return stock_observation_size(model.nq, model.nv, model.nbody), joints
    return (Observer(robot, observation_of(policy)).actor_size,)
