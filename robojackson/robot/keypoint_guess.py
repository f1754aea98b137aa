"""Find the human keypoints on a model without a description, and how sure that is.

A joint of several hinges is where their axes come closest. Metres, in the frame of the body.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.robot.description import Offset
from robojackson.robot.limbs import ARM_WORDS, SIDES, Limb, Skeleton, names_any, names_of, path

FAR_SHARE = 0.1
"""Axes whose closest point is further from their hinges than this share of the limb do not meet."""
HEAD = ("head", "skull", "face")
ROUND = (int(mujoco.mjtGeom.mjGEOM_CAPSULE), int(mujoco.mjtGeom.mjGEOM_CYLINDER))


@dataclass(frozen=True)
class Guess:
    """A keypoint.

    Attributes:
        body: Name.
        offset: Offset in the body, metres.
        why: What it was guessed from.
        sure: Whether it follows from names.
    """

    body: str
    offset: Offset
    why: str
    sure: bool


def guess_keypoints(skeleton: Skeleton) -> dict[str, Guess]:
    """Return the keypoints that can be identified, by name; the others are missing."""
    found: dict[str, Guess] = {}
    for side in SIDES:
        leg, arm = skeleton.limbs.get(f"{side}_leg"), skeleton.limbs.get(f"{side}_arm")
        if leg is not None:
            _add(found, f"{side}_hip", _meeting(skeleton, leg, "hip"))
            _add(found, f"{side}_knee", _anchor(skeleton, leg, "knee"))
            _add(found, f"{side}_foot", _foot(skeleton, leg))
        if arm is not None:
            _add(found, f"{side}_shoulder", _meeting(skeleton, arm, "shoulder"))
            _add(found, f"{side}_elbow", _anchor(skeleton, arm, "elbow"))
            _add(found, f"{side}_hand", _hand(skeleton, arm))
    _add(found, "pelvis", _pelvis(skeleton, found))
    _add(found, "head", _head(skeleton))
    return found


def foot_body(skeleton: Skeleton, leg: Limb) -> int:
    """Return the body that stands on the floor: what the last ankle hinge moves, else the tip."""
    ankle = leg.parts["ankle"]
    return int(skeleton.model.jnt_bodyid[ankle[-1]]) if ankle else leg.bodies[-1]


def _add(found: dict[str, Guess], key: str, guess: Guess | None) -> None:
    if guess is not None:
        found[key] = guess


def _guess(skeleton: Skeleton, body: int, at: np.ndarray, why: str, sure: bool) -> Guess:
    return Guess(skeleton.model.body(body).name, skeleton.local(body, at), why, sure)


def _meeting(skeleton: Skeleton, limb: Limb, part: str) -> Guess | None:
    """Return where the axes of a joint's hinges come closest, on the body that all of them move."""
    hinges = list(limb.parts[part])
    if not hinges:
        return None
    anchors, axes = skeleton.data.xanchor[hinges], skeleton.data.xaxis[hinges]
    # The point with the least sum of squared distances to the lines.
    flat = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    at = anchors[-1]
    if len(hinges) > 1:
        at = np.linalg.lstsq(flat.sum(0), (flat @ anchors[:, :, None]).sum(0)[:, 0], rcond=None)[0]
        reach = np.linalg.norm(skeleton.data.xpos[limb.bodies[-1]] - anchors[0])
        if np.linalg.norm(at - anchors.mean(0)) > max(FAR_SHARE * reach, np.ptp(anchors, 0).max()):
            at = anchors[-1]
    names = ", ".join(skeleton.model.joint(hinge).name for hinge in hinges)
    body = int(skeleton.model.jnt_bodyid[hinges[-1]])
    return _guess(skeleton, body, at, f"axes of {names}", limb.named)


def _anchor(skeleton: Skeleton, limb: Limb, part: str) -> Guess | None:
    """Return the first hinge of a joint."""
    if not limb.parts[part]:
        return None
    hinge = limb.parts[part][0]
    body = int(skeleton.model.jnt_bodyid[hinge])
    why = f"hinge {skeleton.model.joint(hinge).name}"
    return _guess(skeleton, body, skeleton.data.xanchor[hinge], why, limb.named)


def _foot(skeleton: Skeleton, leg: Limb) -> Guess | None:
    """Return the ankle; of a foot without one its lowest geom, as of a ball foot."""
    if leg.parts["ankle"]:
        return _meeting(skeleton, leg, "ankle")
    body = leg.bodies[-1]
    geoms = geoms_of(skeleton.model, body)
    if not geoms:
        return None
    lowest = min(geoms, key=lambda geom: skeleton.data.geom_xpos[geom][2])
    return _guess(skeleton, body, skeleton.data.geom_xpos[lowest], "lowest geom", leg.named)


def _hand(skeleton: Skeleton, arm: Limb) -> Guess | None:
    """Return the end of what follows the elbow, fingers left out."""
    if not arm.parts["elbow"]:
        return None
    model = skeleton.model
    forearm = int(model.jnt_bodyid[arm.parts["elbow"][0]])
    beyond = arm.bodies[arm.bodies.index(forearm) :]
    hands = [b for b in beyond if names_any(names_of(model, b)[:1], ARM_WORDS["wrist"])]
    body = hands[-1] if hands else beyond[-1]
    ends = [end for geom in geoms_of(model, body) for end in _ends(skeleton, geom)]
    elbow = skeleton.data.xanchor[arm.parts["elbow"][0]]
    ends = ends or [skeleton.data.xpos[body]]
    at = max(ends, key=lambda end: float(np.linalg.norm(end - elbow)))
    return _guess(skeleton, body, at, "far end of the body", bool(hands) or arm.named)


def _pelvis(skeleton: Skeleton, found: dict[str, Guess]) -> Guess | None:
    """Return the point midway between the hips, on the body that carries both legs."""
    if not {"left_hip", "right_hip"} <= set(found):
        return None
    at = np.mean([_world(skeleton, found[f"{side}_hip"]) for side in SIDES], axis=0)
    first = skeleton.limbs["left_leg"].bodies[0]
    body = int(skeleton.model.body_parentid[first])
    return _guess(skeleton, body, at, "midway between the hips", found["left_hip"].sure)


def _head(skeleton: Skeleton) -> Guess | None:
    """Return the body called head, else the highest geom of the trunk."""
    model, data, trunk = skeleton.model, skeleton.data, skeleton.trunk
    named = [body for body in trunk if names_any(names_of(model, body), HEAD)]
    if named:
        body = max(named, key=lambda b: len(path(model, b)))
        geoms = geoms_of(model, body)
        at = np.mean(data.geom_xpos[geoms], axis=0) if geoms else data.xpos[body]
        return _guess(skeleton, body, at, f"body {model.body(body).name}", True)
    geoms = [geom for body in trunk for geom in geoms_of(model, body)]
    if not geoms:
        return None
    called = [geom for geom in geoms if names_any(_geom_names(model, geom), HEAD)]
    geom = max(called or geoms, key=lambda geom: float(data.geom_xpos[geom][2]))
    label = next((name for name in _geom_names(model, geom) if name), "without a name")
    why = f"geom {label}" if called else f"highest geom of the trunk, {label}"
    return _guess(skeleton, int(model.geom_bodyid[geom]), data.geom_xpos[geom], why, bool(called))


def geoms_of(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the geoms of a body."""
    first = int(model.body_geomadr[body])
    return list(range(first, first + int(model.body_geomnum[body])))


def _geom_names(model: mujoco.MjModel, geom: int) -> list[str]:
    is_mesh = model.geom_type[geom] == int(mujoco.mjtGeom.mjGEOM_MESH)
    return [model.geom(geom).name, model.mesh(model.geom_dataid[geom]).name if is_mesh else ""]


def _ends(skeleton: Skeleton, geom: int) -> list[Float[np.ndarray, "3"]]:
    """Return both ends of a capsule, the middle of anything else."""
    model, data = skeleton.model, skeleton.data
    centre = data.geom_xpos[geom]
    if model.geom_type[geom] not in ROUND:
        return [centre]
    along = data.geom_xmat[geom].reshape(3, 3)[:, 2] * model.geom_size[geom][1]
    return [centre - along, centre + along]


def _world(skeleton: Skeleton, guess: Guess) -> Float[np.ndarray, "3"]:
    body = skeleton.model.body(guess.body).id
    turn = skeleton.data.xmat[body].reshape(3, 3)
    result: np.ndarray = skeleton.data.xpos[body] + turn @ guess.offset
    return result
