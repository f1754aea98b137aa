"""A first description of a model, guessed from its names and its kinematic tree, as YAML to edit.

Every line names what it was guessed from; what could not be found is a comment in its place.
"""

import json
import os
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from robojackson.errors import BadConfiguration
from robojackson.robot.actuation import both_ways
from robojackson.robot.description import KEYPOINTS, TOES, ContactPoint
from robojackson.robot.fall import rule_lines
from robojackson.robot.keypoint_guess import Guess, guess_keypoints
from robojackson.robot.limbs import SIDES, skeleton_of
from robojackson.robot.model_files import read_model
from robojackson.robot.names import robot_name
from robojackson.robot.stand_guess import guess_contacts, guess_rest, toe_of

WEIGHTS = {"foot": 1.5, "hand": 1.5, "head": 0.5, "toe": 0.7, "pelvis": 0.0}
"""Of the squared error, by the end of a keypoint's name; the others have 1. As Humanoid-v5's."""
SUBSTEPS, SHORTEST_S, LONGEST_S, USUAL_S = 5, 0.01, 0.03, 0.015
"""Of a control step: five steps of the model, or as many as make the usual one where that is too
short or too long."""
DIGITS = 12
"""Of a control step: as a whole number of steps it is checked to a nanosecond."""
SIDE = re.compile("left|right", re.IGNORECASE)
PLAIN = re.compile(r"(?!(?:true|false|null)$)[A-Za-z_][\w./-]*$", re.IGNORECASE)


@dataclass(frozen=True)
class Draft:
    """A first description.

    Attributes:
        name: Name of the robot.
        text: The YAML.
        guessed: Keys to check: no name gave them.
        left: Keys that nothing was found for.
    """

    name: str
    text: str
    guessed: tuple[str, ...]
    left: tuple[str, ...]


def first_description(path: Path, folder: Path, name: str) -> Draft:
    """Guess the description of a model.

    Args:
        path: The MJCF.
        folder: Where the description will be; a model below it is named from there.
        name: Name of the robot.
    Raises:
        BadConfiguration: no such file, or MuJoCo cannot load it.
    """
    model = _model(path)
    skeleton = skeleton_of(model)
    keypoints = guess_keypoints(skeleton)
    contacts = guess_contacts(skeleton, keypoints)
    toes = {
        f"{side}_toe": toe_of(skeleton, keypoints[f"{side}_foot"], contacts, side)
        for side in SIDES
        if f"{side}_foot" in keypoints
    }
    if len(toes) == len(SIDES) and all(toes.values()):
        keypoints |= {key: toe for key, toe in toes.items() if toe is not None}
    has_root = bool((model.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE)).any())
    left = [f"sites.{key}" for key in KEYPOINTS if key not in keypoints]
    left += [] if has_root else ["root_body"]
    left += [f"contacts of the {s} foot" for s in SIDES if not any(s in c for c in contacts)]
    undriven = _undriven(model)
    left += ["torque_limits"] if None in undriven.values() else []
    guessed = [f"sites.{key}" for key, guess in keypoints.items() if not guess.sure]
    lines = [
        f"# {name}: a first description by `robojackson robots new`. A line with GUESS is not",
        "# given by a name; check it in the picture of `robojackson robots check`.",
        f"name: {_text(name)}",
        f"mjcf: {_text(_place(path, folder))}",
        f"root_body: {_text(model.body(skeleton.root).name)} # "
        + ("has the free joint" if has_root else "GUESS: no body has a free joint; give it one"),
        *_site_lines(keypoints),
        *_weight_lines(keypoints),
        *_contact_lines(contacts),
        *_rest_lines(guess_rest(skeleton)),
        *_torque_lines(undriven),
        "max_joint_speed: 12.0 # rad/s; of the motors, where you know it",
        *_clock_lines(model.opt.timestep),
        *rule_lines(),
    ]
    return Draft(name, "\n".join(lines) + "\n", tuple(guessed), tuple(left))


def _model(path: Path) -> mujoco.MjModel:
    if not path.is_file():
        raise BadConfiguration(f"{path}: no such file; expected the MJCF of a robot")
    model = read_model(path)
    if model.nbody < 2 or not (model.jnt_type == int(mujoco.mjtJoint.mjJNT_HINGE)).any():
        raise BadConfiguration(f"{path}: no body with a hinge; expected the MJCF of a robot")
    return model


def name_of_model(path: Path) -> str:
    """Return what a model calls itself, else the name of its file, as a robot's name."""
    text = path.read_text(errors="replace") if path.is_file() else ""
    named = re.search(r"<mujoco[^>]*\bmodel=\"([^\"]+)\"", text)
    name = re.sub(r"\W+", "_", named.group(1) if named else path.stem).strip("_").lower()
    return robot_name(name)


def _place(path: Path, folder: Path) -> str:
    """Return the model's path from the folder of its description, or from the root where it is
    outside."""
    whole, base = Path(os.path.abspath(path)), Path(os.path.abspath(folder))
    return whole.relative_to(base).as_posix() if whole.is_relative_to(base) else str(whole)


def _undriven(model: mujoco.MjModel) -> dict[str, float | None]:
    """Return the hinges that no motor of the model drives -> their own torque limit, None without
    one."""
    hinges = np.flatnonzero(model.jnt_type == int(mujoco.mjtJoint.mjJNT_HINGE))
    joint = int(mujoco.mjtTrn.mjTRN_JOINT)
    driven = set(model.actuator_trnid[model.actuator_trntype == joint, 0].tolist())
    found: dict[str, float | None] = {}
    for hinge in hinges:
        if hinge not in driven:
            limit = both_ways(model.jnt_actfrcrange[hinge])
            found[model.joint(hinge).name] = limit if model.jnt_actfrclimited[hinge] else None
    return found


def _text(name: str) -> str:
    return name if PLAIN.match(name) else json.dumps(name)


def _vector(values: Iterable[float]) -> str:
    return f"[{', '.join(f'{value:g}' if value % 1 else f'{value:.1f}' for value in values)}]"


def _site_lines(keypoints: Mapping[str, Guess]) -> list[str]:
    lines = ["sites: # keypoint: [body, position in the body, metres]"]
    for key in (*KEYPOINTS, *(toe for toe in TOES if toe in keypoints)):
        if key not in keypoints:
            lines.append(f"  # {key}: [BODY, [0.0, 0.0, 0.0]] # not found: put a body in")
            continue
        guess = keypoints[key]
        sure = "" if guess.sure else "GUESS: "
        lines.append(f"  {key}: [{_text(guess.body)}, {_vector(guess.offset)}] # {sure}{guess.why}")
    return lines


def _weight_lines(keypoints: Mapping[str, Guess]) -> list[str]:
    lines = ["weights: # of the squared keypoint error, as Humanoid-v5's"]
    for key in (*KEYPOINTS, *TOES):
        weight = WEIGHTS.get(key.rpartition("_")[2], 1.0)
        if key in keypoints and weight:
            lines.append(f"  {key}: {weight}")
    return lines if len(lines) > 1 else ["weights: {}"]


def _contact_lines(contacts: Mapping[str, ContactPoint]) -> list[str]:
    lines = [
        "contacts: # balls under the soles; offset of the centre from the foot's keypoint, metres"
    ]
    for name, ball in contacts.items():
        words = f"site: {ball.site}, offset: {_vector(ball.offset)}, radius: {ball.radius:g}"
        lines.append(
            f"  {name}: {{{words}, body: {_text(ball.body)}, side: {ball.side}, "
            f"label: {ball.label}}}"
        )
    for side in SIDES:
        if not any(ball.side == side for ball in contacts.values()):
            lines.append(
                f"  # {side}_foot: {{site: {side}_foot, radius: 0.02, body: BODY, side: {side}}}"
            )
    return lines if contacts else ["contacts: {}", *lines[1:]]


def _rest_lines(rest: Mapping[str, float]) -> list[str]:
    if not rest:
        return ["rest_pose: {} # radians; a hinge that is not named rests at zero"]
    lines = ["rest_pose: # radians; a hinge that is not named rests at zero"]
    return lines + [f"  {_text(name)}: {angle!r}" for name, angle in rest.items()]


def _torque_lines(undriven: Mapping[str, float | None]) -> list[str]:
    """Return the limits that the hinges have themselves; the others as comments, both sides in
    one."""
    known = {name: limit for name, limit in undriven.items() if limit is not None}
    lines = ["torque_limits: # newton-metres, of the hinges themselves: no motor drives them"]
    lines += [f"  {_text(name)}: {limit:g}" for name, limit in known.items()]
    unknown = [name for name in undriven if name not in known]
    if not unknown:
        return lines if known else []
    patterns = Counter(SIDE.sub("*", name) for name in unknown)
    named = [
        p if n > 1 else next(x for x in unknown if SIDE.sub("*", x) == p)
        for p, n in patterns.items()
    ]
    rest = [f"{_text(name)}: 50.0" for name in named]
    note = "newton-metres, of hinges that no motor of the MJCF drives: fill in your motors'"
    if known:
        return [*lines, f"  # {note}", *(f"  # {line}" for line in rest)]
    return [f"# torque_limits: # {note}", *(f"#   {line}" for line in rest)]


def _clock_lines(timestep: float) -> list[str]:
    steps = SUBSTEPS
    if not SHORTEST_S <= steps * timestep <= LONGEST_S:
        steps = max(1, round(USUAL_S / timestep))
    named = f"{steps} steps of {1e3 * timestep:g} ms of the model"
    return [f"control_dt: {steps * timestep:.{DIGITS}g} # seconds: {named}"]
