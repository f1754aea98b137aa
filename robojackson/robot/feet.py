"""The feet of a robot: what stands on the floor with the bodies of its contacts.

That is the body itself and what is welded below it. A body that touches nothing, such as a frame
under the sole, stands for the nearest body above it that does and that it is welded to: beyond
that is the leg, to which a foot without an ankle is welded, too.
"""

from collections.abc import Iterator

import mujoco
import numpy as np
from jaxtyping import Int


def foot_bodies(model: mujoco.MjModel, contacts: Int[np.ndarray, " C"]) -> Int[np.ndarray, " F"]:
    """Return the bodies of the feet of a compiled model.

    Args:
        contacts: Bodies of its contact points.
    """
    solid = (model.geom_contype | model.geom_conaffinity) != 0
    touching = np.isin(np.arange(model.nbody), model.geom_bodyid[solid])
    found: set[int] = set()
    for body in contacts:
        foot = _welded_below(model, int(body))
        while not touching[foot].any() and model.body_weldid[body] != body:
            body = model.body_parentid[body]
            foot = _welded_below(model, int(body))
        found.update(foot)
    return np.array(sorted(found))


def _welded_below(model: mujoco.MjModel, body: int) -> list[int]:
    found = [body]
    for child in range(body + 1, model.nbody):  # parents come first
        if model.body_parentid[child] in found and not model.body_jntnum[child]:
            found.append(child)
    return found


def foot_geoms(body: mujoco.MjsBody) -> list[mujoco.MjsGeom]:
    """Return the geoms of the foot of a contact's body in a spec."""
    geoms = list(_geoms_below(body))
    while not (body.joints or any(geom.contype or geom.conaffinity for geom in geoms)):
        if body.parent.name == "world":
            break
        body = body.parent
        geoms = list(_geoms_below(body))
    return geoms


def _geoms_below(body: mujoco.MjsBody) -> Iterator[mujoco.MjsGeom]:
    """Yield the geoms of a body and of those that are welded below it."""
    yield from body.geoms
    for child in body.bodies:
        if not child.joints:
            yield from _geoms_below(child)
