"""Control law of networks that a training starts from, beside the training's own.

Two laws are the same where an action means the same: the kind of law, the shares of feed-forward
and feedback, and for every motor the gains and the radians of a full action. Files without a law,
as those of SB3, cannot be compared.
"""

import json
import logging
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from robojackson.errors import BadPolicy
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.policy_facts import fact, recorded_law
from robojackson.rl.sim.motors import Motors, actuation_facts
from robojackson.rl.tqc.network_arrays import Networks
from robojackson.rl.walkers import STARTS
from robojackson.robot.model import Robot

log = logging.getLogger(__name__)

ACTIONS = ("law", "feedback", "feedforward", "action_factor", "residual", "arm_residual")
GAINS = ("stiffness", "damping")
"""Numbers of a control law that say what an action does."""
OLDER_LAW = {"law": "pd", "feedback": 0.0, "feedforward": 0.0, "action_factor": 1.0}
"""Those of files from before they could be chosen; of the others null is the robot's own."""


def require_same_law(networks: Networks, control: ControlConfig, robot: Robot, start: str) -> None:
    """Refuse networks as the start of a training in which their actions would mean something else.

    `walker` of another law is no more than a warning: a robot has one walker, and a training may
    have any law (`--robust` doubles the G1's actions); what it knows about standing helps even
    where its actions are of another size.

    Args:
        networks: A policy's actor, or actor and critics.
        control: Control law of the training, with every number.
        robot: The robot of the training.
        start: How the training names them.

    Raises:
        BadPolicy: another control law, or a policy of another robot.
    """
    trained_for = networks.facts.get("robot")
    if networks.is_policy and trained_for != robot.description.name:
        raise BadPolicy(
            f"start {start!r} was trained for robot {trained_for!r}, not for "
            f"{robot.description.name!r}"
        )
    found = dict(_differences(networks, control, robot))
    if not found:
        return
    apart = "; ".join(f"{name} {text}" for name, text in found.items())
    law = recorded_law(networks)
    if networks.is_policy or start not in STARTS:
        remedy = _remedy(law, control, ACTIONS + GAINS) or "restore the robot's YAML"
        raise BadPolicy(f"start {start!r} has another control law: {remedy} ({apart})")
    # Its gains may be unstable on this robot.
    settings = "" if set(found) <= set(GAINS) else _remedy(law, control, ACTIONS)
    own = (
        f"robojackson pretrain --kind track --robot {robot.description.name} makes one of this law"
    )
    log.warning(
        "start %r has learnt another control law, and its actions mean something else here: %s; %s",
        start, apart, f"to train on with its own law: {settings}" if settings else own,
    )  # fmt: skip


def _differences(
    networks: Networks, control: ControlConfig, robot: Robot
) -> Iterator[tuple[str, str]]:
    """Yield what an action means there and here, by name, where that differs."""
    law = recorded_law(networks)
    if not law:
        return
    for name in ("law",) if control.law == "torque" else ("law", "feedback", "feedforward"):
        then, now = _number(law, name), getattr(control, name)
        if then != now:
            yield name, f"{then} there, {now} here"
    if "torque" in (control.law, _number(law, "law")):
        return
    learnt = networks.facts.get("actuation")
    if not isinstance(learnt, Mapping):  # a file from before it was recorded
        learnt = actuation_facts(robot, fact(networks, "control", ControlConfig))
    motors = [robot.joint_names[hinge] for hinge in Motors.of(robot.model).hinge]
    for name, here in actuation_facts(robot, control).items():
        there = _array(learnt.get(name, here), f"actuation.{name}")
        if there.shape != (len(motors),) or np.allclose(there, here, rtol=1e-6):
            continue  # networks for another number of motors fit no layer
        worst = int(np.argmax(np.abs(there - here)))
        yield name, f"{there[worst]:g} of {motors[worst]} there, {here[worst]:g} here"


def _remedy(law: Mapping[str, object], control: ControlConfig, names: Iterable[str]) -> str:
    """Return the settings that give a training these numbers of the recorded law."""
    apart = [name for name in names if _number(law, name) != getattr(control, name)]
    return " ".join(f"--set track.control.{name}={_text(_number(law, name))}" for name in apart)


def _number(law: Mapping[str, object], name: str) -> object:
    """Return a number of a recorded law."""
    found = law.get(name)
    return OLDER_LAW.get(name) if found is None else found


def _array(values: object, name: str) -> np.ndarray:
    """Return recorded numbers as an array."""
    try:
        return np.asarray(values, float)
    except (TypeError, ValueError) as error:
        raise BadPolicy(f"the file of the start has {name} that is no list of numbers") from error


def _text(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value)
