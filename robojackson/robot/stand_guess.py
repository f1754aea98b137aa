"""The stand of a model without a description: its rest pose, and the balls under its feet.

The balls are the corners of what it stands on: a foot that is one ball gets one contact; any other
those four of its lowest points that are furthest out. Metres, radians; x forward, y left, z up in
the zero pose.
"""

from dataclasses import dataclass
from itertools import product
from math import copysign

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.robot.body_states import solid_geoms
from robojackson.robot.description import ContactPoint
from robojackson.robot.keypoint_guess import Guess, foot_body, geoms_of
from robojackson.robot.limbs import SIDES, Limb, Skeleton

RADIUS_M = 0.01
"""Of a ball at a corner of a box or a mesh; in a thinner box half its thickness."""
LEVEL_M = 0.004
"""What is higher than the lowest point by more than this carries no weight."""
SAME_M = 0.02
SPHERE, CAPSULE, BOX, MESH = (
    int(getattr(mujoco.mjtGeom, f"mjGEOM_{kind}")) for kind in ("SPHERE", "CAPSULE", "BOX", "MESH")
)
CORNERS = {
    "heel_out": ("heel", -1, 1), "heel_in": ("heel", -1, -1),
    "toe_out": ("toe", 1, 1), "toe_in": ("toe", 1, -1),
}  # fmt: skip
"""Label, forward or back, out or in."""
BENT_RAD = 0.3
"""How far the knees are bent at rest; hips and ankles half as far."""
SIDEWAYS = 0.9
"""Least share of y in the axis of a hinge that bends a leg forward."""
DIGITS = 4
"""Decimals of a rest angle at the limit of its hinge."""


@dataclass(frozen=True)
class _Ball:
    centre: Float[np.ndarray, "3"]
    radius: float

    @property
    def lowest(self) -> float:
        return float(self.centre[2] - self.radius)


def guess_contacts(skeleton: Skeleton, keypoints: dict[str, Guess]) -> dict[str, ContactPoint]:
    """Return the contacts of both feet, by name; none for a foot that cannot be identified."""
    found: dict[str, ContactPoint] = {}
    for sign, side in ((1.0, SIDES[0]), (-1.0, SIDES[1])):
        leg, foot = skeleton.limbs.get(f"{side}_leg"), keypoints.get(f"{side}_foot")
        if leg is None or foot is None:
            continue
        balls = _standing(skeleton, leg)
        if not balls:
            continue
        ground = np.array([ball.centre[:2] for ball in balls])
        if np.ptp(ground, axis=0).max() < SAME_M:
            found[f"{side}_foot"] = _contact(skeleton, balls[0], foot, side, "either")
            continue
        low, high = ground.min(0), ground.max(0)
        spread = (ground - (low + high) / 2) / np.maximum(high - low, 1e-9)
        for corner, (label, ahead, out) in CORNERS.items():
            best = int(np.argmax(spread @ [ahead, out * sign]))
            name = f"{side}_{corner}"
            found[name] = _contact(skeleton, balls[best], foot, side, label)
    return found


def toe_of(
    skeleton: Skeleton, foot: Guess, contacts: dict[str, ContactPoint], side: str
) -> Guess | None:
    """Return the tip of a foot, between its two front corners, where it has an ankle to aim it
    with."""
    front = [contacts.get(f"{side}_toe_{edge}") for edge in ("out", "in")]
    leg = skeleton.limbs.get(f"{side}_leg")
    balls = [ball for ball in front if ball is not None]
    if leg is None or not leg.parts["ankle"] or len(balls) < len(front):
        return None
    offset = np.mean([ball.offset for ball in balls], axis=0) + foot.offset
    x, y, z = np.round(offset, 4) + 0.0
    return Guess(foot.body, (float(x), float(y), float(z)), "between the front corners", foot.sure)


def guess_rest(skeleton: Skeleton) -> dict[str, float]:
    """Return knees a little bent over level feet, radians; hinges that cannot be zero are at a
    limit, none beyond it."""
    model, found = skeleton.model, dict[str, float]()
    for hinge in np.flatnonzero(model.jnt_type == int(mujoco.mjtJoint.mjJNT_HINGE)):
        low, high = model.jnt_range[hinge]
        if model.jnt_limited[hinge] and not low <= 0.0 <= high:
            found[model.joint(hinge).name] = _nearest_to_zero(float(low), float(high))
    bent: dict[str, float] = {}
    for side in SIDES:
        leg = skeleton.limbs.get(f"{side}_leg")
        if leg is None:
            return found
        turns = {"hip": -BENT_RAD / 2, "knee": BENT_RAD, "ankle": -BENT_RAD / 2}
        for part, turn in turns.items():
            if part == "ankle" and not leg.parts[part]:
                continue
            across = [h for h in leg.parts[part] if abs(skeleton.data.xaxis[h][1]) > SIDEWAYS]
            if not across:
                return found
            angle = turn * float(np.sign(skeleton.data.xaxis[across[0]][1]))
            low, high = model.jnt_range[across[0]]
            if model.jnt_limited[across[0]] and not low < angle < high:
                return found
            bent[model.joint(across[0]).name] = angle
    return found | bent


def _nearest_to_zero(low: float, high: float) -> float:
    """Return the angle of a range without zero that is nearest to zero, rounded into the range;
    the limit itself in a range that holds no such angle."""
    limit = low if low > 0.0 else high
    near = round(limit, DIGITS)
    inward = round(near + copysign(10.0**-DIGITS, limit), DIGITS)
    return next((angle for angle in (near, inward) if low <= angle <= high), limit)


def _contact(skeleton: Skeleton, ball: _Ball, foot: Guess, side: str, label: str) -> ContactPoint:
    body = skeleton.model.body(foot.body).id
    x, y, z = np.round(np.subtract(skeleton.local(body, ball.centre), foot.offset), 4) + 0.0
    return ContactPoint(
        site=f"{side}_foot",
        radius=round(ball.radius, 4),
        body=foot.body,
        side=side,
        offset=(float(x), float(y), float(z)),
        label=label,  # type: ignore[arg-type]
    )


def _standing(skeleton: Skeleton, leg: Limb) -> list[_Ball]:
    """Return the lowest balls of a foot and of what is fixed to it."""
    model, body = skeleton.model, foot_body(skeleton, leg)
    bodies = [body]
    for child in range(body + 1, model.nbody):
        if model.body_parentid[child] in bodies and not model.body_jntnum[child]:
            bodies.append(child)
    geoms = [geom for each in bodies for geom in geoms_of(model, each)]
    solid = [geom for geom in geoms if solid_geoms(model)[geom]]
    balls = [ball for geom in solid or geoms for ball in _balls(skeleton, geom)]
    floor = min((ball.lowest for ball in balls), default=0.0)
    return [ball for ball in balls if ball.lowest < floor + LEVEL_M]


def _balls(skeleton: Skeleton, geom: int) -> list[_Ball]:
    model, data = skeleton.model, skeleton.data
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    centre, turn = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
    if kind == SPHERE:
        return [_Ball(centre, float(size[0]))]
    if kind == CAPSULE:
        ends = (centre + sign * size[1] * turn[:, 2] for sign in (-1, 1))
        return [_Ball(end, float(size[0])) for end in ends]
    if kind == BOX:
        radius = min(RADIUS_M, float(size.min()))
        signs = np.array(list(product((-1, 1), repeat=3)))
        return [_Ball(centre + turn @ (sign * (size - radius)), radius) for sign in signs]
    if kind == MESH:
        mesh = model.geom_dataid[geom]
        first = int(model.mesh_vertadr[mesh])
        points = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])] @ turn.T + centre
    else:
        signs = np.array(list(product((-1, 1), repeat=3)))
        middle, half = model.geom_aabb[geom][:3], model.geom_aabb[geom][3:]
        points = (middle + signs * half) @ turn.T + centre
    inward = centre - points
    inward[:, 2] = 0.0
    inward /= np.maximum(np.linalg.norm(inward, axis=1, keepdims=True), 1e-9)
    pairs = zip(points, inward, strict=True)
    return [_Ball(p + RADIUS_M * (step + [0, 0, 1]), RADIUS_M) for p, step in pairs]
