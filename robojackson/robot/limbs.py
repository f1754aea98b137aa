"""Find legs and arms of a model without a description: from names, else from the tree.

World frame of the zero pose: x forward, y left, z up, metres. Hinges are joint indices.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, Int

LEG_WORDS = {
    "hip": ("hip", "thigh", "femur", "upperleg"),
    "knee": ("knee", "shin", "calf", "shank", "tibia", "lowerleg"),
    "ankle": ("ankle", "foot", "sole", "toe"),
}
TOED: dict[str, tuple[str, ...]] = {"toe": ("toe",), "ankle": LEG_WORDS["ankle"]}
"""Words of toes, and of what else is of a foot."""
ARM_WORDS = {
    "shoulder": ("shoulder", "upperarm", "clavicle", "humerus", "scapula"),
    "elbow": ("elbow", "forearm", "lowerarm"),
    "wrist": ("wrist", "hand", "palm"),
}
SIDES = ("left", "right")
ASIDE_M = 0.02
"""A body that is further to the left than this is a left one."""
GAP_SHARE = 0.15
"""Hinges that are further apart than this share of their limb are of different joints."""
Words = dict[str, tuple[str, ...]]


@dataclass(frozen=True)
class Limb:
    """A leg or an arm.

    Attributes:
        bodies: Bodies from the first that the other side does not share to the tip.
        parts: Name of each joint (hip, knee, ankle; shoulder, elbow, wrist) -> its hinges.
        named: Whether names identify them; else the distances of the hinges do.
    """

    bodies: tuple[int, ...]
    parts: dict[str, tuple[int, ...]]
    named: bool


@dataclass(frozen=True)
class Skeleton:
    """A model in its zero pose, and its limbs by name: `left_leg`, `right_arm`."""

    model: mujoco.MjModel
    data: mujoco.MjData
    root: int
    limbs: dict[str, Limb]

    @property
    def trunk(self) -> list[int]:
        """Bodies that are of no limb."""
        taken = {body for limb in self.limbs.values() for body in limb.bodies}
        return [b for b in self.bodies if not taken & set(path(self.model, b))]

    @property
    def bodies(self) -> list[int]:
        """Bodies that the root carries, itself first; all where it has no free joint."""
        roots, all_bodies = self.model.body_rootid, range(1, self.model.nbody)
        return [b for b in all_bodies if not _free(self.model).size or roots[b] == self.root]

    def local(self, body: int, point: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
        """Return a point of the world in the frame of a body, to a tenth of a millimetre."""
        turn = self.data.xmat[body].reshape(3, 3)
        x, y, z = np.round((point - self.data.xpos[body]) @ turn, 4) + 0.0
        return float(x), float(y), float(z)


def skeleton_of(model: mujoco.MjModel) -> Skeleton:
    """Find the root and the limbs of a model."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    whole = Skeleton(model, data, _root_of(model), {})
    tips = [b for b in whole.bodies if b not in set(model.body_parentid[1:])]
    paths = {side: [path(model, t) for t in tips if side_of(whole, t) == side] for side in SIDES}
    legs = {side: _leg(whole, found) for side, found in paths.items()}
    taken = {body for leg in legs.values() for body in leg if side_of(whole, body)}
    free_paths = {s: [p for p in found if not taken & set(p)] for s, found in paths.items()}
    arms = {side: _arm(whole, found) for side, found in free_paths.items()}
    limbs = {}
    for kind, found, words in (("leg", legs, LEG_WORDS), ("arm", arms, ARM_WORDS)):
        shared = set(found["left"]) & set(found["right"])
        for side in SIDES:
            bodies = tuple(b for b in found[side] if b not in shared)
            if bodies and found["left"] and found["right"]:
                limbs[f"{side}_{kind}"] = _limb(whole, bodies, words)
    return Skeleton(model, data, whole.root, limbs)


def _root_of(model: mujoco.MjModel) -> int:
    """Return the body with the free joint that carries the most hinges; the first without any."""
    turning = hinges_of(model, range(model.nbody))
    carriers = model.body_rootid[model.jnt_bodyid[turning]]
    free = [int(body) for body in model.jnt_bodyid[_free(model)]]
    return max(free, key=lambda body: int((carriers == body).sum()), default=1)


def _free(model: mujoco.MjModel) -> Int[np.ndarray, " F"]:
    return np.flatnonzero(model.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE))


def side_of(skeleton: Skeleton, body: int) -> str:
    """Return left or right by the names of a body and its joints, else by its place; empty:
    neither."""
    for name in names_of(skeleton.model, body):
        plain = name.lower()
        tokens = re.split(
            r"[^a-zA-Z]+", re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[LR])(?=[A-Z])", " ", name)
        )
        for side in SIDES:
            if side in plain or side[0].upper() in tokens or side[0] in tokens:
                return side
    aside = skeleton.data.xpos[body][1] - skeleton.data.xpos[skeleton.root][1]
    return "" if abs(aside) < ASIDE_M else SIDES[int(aside < 0)]


def names_of(model: mujoco.MjModel, body: int) -> list[str]:
    """Return the name of a body and of its joints."""
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    joints = [model.joint(index).name for index in range(first, first + count)]
    return [model.body(body).name, *joints]


def names_any(names: Iterable[str], words: Iterable[str]) -> bool:
    """Return whether one of the names has one of the words in it."""
    plain = [re.sub(r"[^a-z]", "", name.lower()) for name in names]
    return any(word in name for name in plain for word in words)


def path(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the bodies from the root to a body."""
    found = []
    while body > 0:
        found.append(body)
        body = int(model.body_parentid[body])
    return found[::-1]


def hinges_of(model: mujoco.MjModel, bodies: Iterable[int]) -> list[int]:
    """Return the hinges between bodies and their parents, in order."""
    hinge = int(mujoco.mjtJoint.mjJNT_HINGE)
    found: list[int] = []
    for body in bodies:
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        found += [j for j in range(first, first + count) if model.jnt_type[j] == hinge]
    return found


def _leg(skeleton: Skeleton, paths: list[list[int]]) -> list[int]:
    """Return the path to the lowest tip."""
    return min(paths, key=lambda found: skeleton.data.xpos[found[-1]][2], default=[])


def _arm(skeleton: Skeleton, paths: list[list[int]]) -> list[int]:
    """Return the path whose names are an arm's, or that has most hinges; of fingers the first."""
    model = skeleton.model
    words = [word for part in ARM_WORDS.values() for word in part]

    def rank(found: list[int]) -> tuple[bool, int]:
        named = any(names_any(names_of(model, body), words) for body in found)
        return named, len(hinges_of(model, found))

    return max(paths, key=rank, default=[])


def _limb(skeleton: Skeleton, bodies: tuple[int, ...], words: Words) -> Limb:
    model = skeleton.model
    hinges = hinges_of(model, bodies)
    parts: dict[str, list[int]] = {name: [] for name in words}
    for hinge in hinges:
        name = _part_of(model, hinge, words)
        if name is not None:
            parts[name].append(hinge)
    first, second, third = parts
    feet = [hinge for hinge in parts[third] if _part_of(model, hinge, TOED) != "toe"]
    parts[third] = feet or parts[third]
    if parts[first] and parts[second]:
        return Limb(bodies, {k: tuple(v) for k, v in parts.items()}, True)
    return Limb(bodies, _by_distance(skeleton, bodies, hinges, tuple(words)), False)


def _part_of(model: mujoco.MjModel, hinge: int, words: Words) -> str | None:
    """Return the part that a hinge's name has a word of, else its body's name; None without one."""
    own, body = [model.joint(hinge).name], [model.body(model.jnt_bodyid[hinge]).name]
    kinds = (name for called in (own, body) for name in words if names_any(called, words[name]))
    return next(kinds, None)


def _by_distance(
    skeleton: Skeleton, bodies: tuple[int, ...], hinges: list[int], names: tuple[str, ...]
) -> dict[str, tuple[int, ...]]:
    """Return hinges grouped to joints by distance, in the order of the joints."""
    if not hinges:
        return dict.fromkeys(names, ())
    at = skeleton.data.xanchor[hinges]
    gaps = np.linalg.norm(np.diff(at, axis=0), axis=1)
    whole = gaps.sum() + np.linalg.norm(skeleton.data.xpos[bodies[-1]] - at[-1])
    cuts = np.flatnonzero(gaps > GAP_SHARE * whole) + 1
    groups = [tuple(int(h) for h in group) for group in np.split(np.array(hinges), cuts)]
    groups += [()] * len(names)
    return dict(zip(names, groups[: len(names)], strict=True))
