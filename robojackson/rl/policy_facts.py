"""Facts of a policy's training, checked against the robot that it will drive."""

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TypeVar, get_args

import numpy as np
from jaxtyping import Float
from pydantic import TypeAdapter, ValidationError

from robojackson.errors import BadPolicy
from robojackson.motion.reference_motion import ReferenceMotion, poses_sha256
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.modes.observation import Kind, Observer
from robojackson.rl.policy import Policy, load_policy
from robojackson.rl.sim.motors import Motors, actuation_facts
from robojackson.rl.sim.stock_humanoid import stock_observation_size
from robojackson.rl.tqc.network_arrays import Networks
from robojackson.robot.model import Robot

T = TypeVar("T")
OUTLINE = "feedback_outline"
"""Name of the outline of the feedback's path in a policy's file."""
OTHER_PATH = (
    "the policy was trained on top of feedback along another path than this machine has found: "
    "copy the folder feedback of the store in which it was trained, or train it here"
)
SAME_PATH_RAD = 0.02
"""Largest difference of a hinge at which a path is the same."""


def mode_of(policy: Policy) -> str:
    """Return `track` or `paper`.

    Raises:
        BadPolicy: The file has another mode.
    """
    mode = str(policy.facts.get("mode", "track"))
    if mode not in ("track", "paper"):
        raise BadPolicy(f"the policy's file has mode {mode[:40]!r}; known: paper, track")
    return mode


def recorded_law(policy: Policy | Networks) -> Mapping[str, object]:
    """Return the control law as a file has it, unchecked; empty where it has none."""
    held = policy.facts.get("control")
    return held if isinstance(held, Mapping) else {}


def is_of_another_motion(policy: Policy, reference: ReferenceMotion) -> bool:
    """Return whether a policy's file names another reference motion than this as the one it was
    trained on."""
    learnt = policy.facts.get("reference_sha256")
    return learnt is not None and learnt != poses_sha256(reference)


def outline_facts(outline: Float[np.ndarray, "M J"] | None) -> dict[str, object]:
    """Return the outline of the path of a training's feedback, for the policy's file; nothing where
    there is none."""
    return {} if outline is None else {OUTLINE: np.round(outline, 4).tolist()}


def is_of_another_path(policy: Policy, outline: Float[np.ndarray, "M J"] | None) -> bool:
    """Return whether the feedback keeps to another path than in the policy's training.

    The search for a path amplifies how a processor rounds: another machine may find another one
    (docs/learning_g1.md, "One search of a long motion is a lottery").

    Raises:
        BadPolicy: the file has no outline but something else.
    """
    if outline is None or OUTLINE not in policy.facts:
        return False
    then = fact(policy, OUTLINE, list[list[float]])
    if [len(row) for row in then] != [len(row) for row in outline]:
        return True
    return bool(np.abs(np.array(then) - outline).max() > SAME_PATH_RAD)


def require_same_path(trained: Path, outline: Float[np.ndarray, "M J"] | None) -> None:
    """Raise where a training would go on along another path than its policy was trained on.

    Raises:
        BadPolicy: `trained`, the policy so far, is of another path, or no policy.
    """
    if trained.is_file() and is_of_another_path(load_policy(trained), outline):
        raise BadPolicy(f"{trained}: {OTHER_PATH}, in another folder")


def networks_sha256(policy: Policy) -> str:
    """Return a digest of a policy's weights."""
    digest = hashlib.sha256()
    for array in (array for layer in policy.layers for array in layer):
        digest.update(f"{array.shape}".encode() + np.asarray(array, np.float32).tobytes())
    return digest.hexdigest()


def policy_control(policy: Policy, robot: Robot) -> ControlConfig:
    """Return the control law that a policy was trained with.

    Raises:
        BadPolicy: the policy was trained for another robot, or its file has no control law.
    """
    trained_for = policy.facts.get("robot", robot.description.name)
    if trained_for != robot.description.name:
        raise BadPolicy(
            f"the policy was trained for robot {trained_for!r}, not for {robot.description.name!r}"
        )
    if "control" not in policy.facts:
        raise BadPolicy("the policy's file has no control law")
    sizes = observation_sizes(policy, robot)
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
    if control.feedback is None:  # trained before the feedback existed
        control = replace(control, feedback=0.0)
    if control.root_state is None:  # trained before it could be estimated
        control = replace(control, root_state="exact")
    if control.feedback_path is None:  # trained before there was a choice
        control = replace(control, feedback_path="reference")
    if control.action_factor is None:  # trained before there was one: pushes must not change it
        control = replace(control, action_factor=1.0)
    _require_same_actuation(policy, robot, control)
    return control


def _require_same_actuation(policy: Policy, robot: Robot, control: ControlConfig) -> None:
    """Raise if the robot's gains or action scale have changed since the policy was trained.

    Raises:
        BadPolicy: the message names the first motor that differs.
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
            "it again"
        )


def fact(policy: Policy | Networks, name: str, kind: type[T]) -> T:
    """Return a configuration from a policy's file.

    Raises:
        BadPolicy: it holds values that this version does not know.
    """
    try:
        return TypeAdapter(kind).validate_python(policy.facts[name])
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, (name, *first["loc"])))
        raise BadPolicy(
            f"the policy's file has {where} = {first['input']!r} ({first['msg']}): it is of "
            "another version of RoboJackson; train it again"
        ) from error


def observation_of(policy: Policy) -> Kind:
    """Return the kind of inputs of a policy of mode `track`.

    Raises:
        BadPolicy: The file has another kind, or its environment is not an object.
    """
    held = policy.facts.get("environment", {})
    if not isinstance(held, Mapping):
        kind = type(held).__name__
        raise BadPolicy(f"the policy's file has an environment that is a {kind}, not an object")
    kinds: dict[object, Kind] = {kind: kind for kind in get_args(Kind)}
    said = str(held.get("observation", "full"))
    if said not in kinds:
        raise BadPolicy(
            f"the policy's file has observation {said[:40]!r}; known: {', '.join(get_args(Kind))}"
        )
    return kinds[said]


def observation_sizes(policy: Policy, robot: Robot) -> tuple[int, ...]:
    """Return the possible lengths of a policy's observations."""
    model = robot.model
    if mode_of(policy) == "paper":
        joints = model.nq - 2 + model.nv
        return stock_observation_size(model.nq, model.nv, model.nbody), joints
    return (Observer(robot, observation_of(policy)).actor_size,)
