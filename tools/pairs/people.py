"""Many people: Anny's body with other phenotypes and clothes, skinned fast; where BlazePose's 33
landmarks truly are.

Anny's world (x left, y backward, z up), metres.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from tools.render import dance_floor, deepmimic
from tools.render.anny_body import Body

PHENOTYPE: Mapping[str, tuple[float, float]] = {
    "gender": (0.0, 1.0), "age": (0.5, 0.85), "height": (0.25, 0.75), "weight": (0.2, 0.8),
    "muscle": (0.3, 0.8), "proportions": (0.2, 0.8),
}  # fmt: skip
"""Range of each of Anny's shape parameters, 0..1."""
BONE_MARKS: Mapping[str, str] = {
    "shoulder": "upperarm01", "elbow": "lowerarm01", "wrist": "wrist", "hip": "upperleg01",
    "knee": "lowerleg01", "ankle": "foot", "index": "finger2-1", "pinky": "finger5-1",
    "thumb": "finger1-2", "eye": "eye",
}  # fmt: skip
"""Landmark -> the bone whose head it is."""


@dataclass(frozen=True)
class Posed:
    """Skin and bones of one clip; a vertex array is made one frame at a time by `Person.skin`."""

    turns: np.ndarray
    heads: np.ndarray


class Person:
    """One body with clothes."""

    def __init__(self, body: Body, rng: np.random.Generator) -> None:
        self.body = body
        weights, indices = (
            body.model.vertex_bone_weights.numpy(),
            body.model.vertex_bone_indices.numpy(),
        )
        count, each = weights.shape
        rows = np.repeat(np.arange(count), each)
        shape = (count, len(body.bone_names))
        entries = (weights.ravel(), (rows, indices.ravel()))
        self.weights = csr_matrix(entries, shape=shape, dtype=np.float32)
        self.heads = body.rest_bones[:, :3, 3].astype(np.float32)
        self.parents = [int(p) for p in body.model.bone_parents]
        self.bare = body.rest_vertices.astype(np.float32)
        self.colour, thickness = clothes(body, rng)
        normals = dance_floor.vertex_normals(self.bare, body.triangles)
        self.rest = (self.bare + normals * thickness[:, None]).astype(np.float32)
        self.marks = _surface_marks(body)

    def posed(self, motion: deepmimic.Motion) -> Posed:
        """Return the rotation from rest and head of every bone."""
        poses = self.body._bone_poses(motion)
        rest = self.body.rest_bones[None, :, :3, :3]
        turns = poses[:, :, :3, :3] @ np.swapaxes(rest, -1, -2)
        heads = np.zeros_like(turns[..., 0])
        for bone, parent in enumerate(self.parents):
            if parent < 0 or bone == 0:
                heads[:, bone] = poses[:, bone, :3, 3]
            else:
                offset = self.heads[bone] - self.heads[parent]
                heads[:, bone] = heads[:, parent] + turns[:, parent] @ offset
        return Posed(turns.astype(np.float32), heads.astype(np.float32))

    def skin(self, posed: Posed, frame: int) -> np.ndarray:
        """Return the vertices of one frame, with clothes."""
        turns = posed.turns[frame]
        shift = posed.heads[frame] - np.einsum("bij,bj->bi", turns, self.heads)
        table = np.concatenate([turns.reshape(-1, 9), shift], 1)
        mixed = self.weights @ table
        vertices = (mixed[:, :9].reshape(-1, 3, 3) @ self.rest[:, :, None])[..., 0]
        return vertices + mixed[:, 9:]

    def landmarks(self, posed: Posed, names: tuple[str, ...]) -> np.ndarray:
        """Return True places of BlazePose's landmarks, (T, 33, 3); NaN where there is none."""
        result = np.full((len(posed.heads), len(names), 3), np.nan, np.float32)
        for column, name in enumerate(names):
            side, _, part = name.partition("_")
            if part in BONE_MARKS:
                bone = f"{BONE_MARKS[part]}.{side[0].upper()}"
                result[:, column] = posed.heads[:, self.body.bone_names.index(bone)]
            elif name in self.marks:
                bone, point = self.marks[name]
                index = self.body.bone_names.index(bone)
                offset = point - self.heads[index]
                result[:, column] = posed.heads[:, index] + posed.turns[:, index] @ offset
        return result


def draw_person(model: Body, rng: np.random.Generator) -> Person:
    """Draw a random person."""
    phenotype = {name: float(rng.uniform(*ends)) for name, ends in PHENOTYPE.items()}
    return Person(Body(phenotype, model.model), rng)


def clothes(body: Body, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return the colour of every vertex, and how thick the cloth is over it, metres."""
    skin = np.array([0.80, 0.58, 0.47]) * rng.uniform(0.25, 1.1) * rng.normal(1.0, 0.05, 3)
    shirt, trousers, shoes = rng.uniform(0.03, 0.95, (3, 3))
    hair = np.array([0.25, 0.17, 0.1]) * rng.uniform(0.2, 2.5)
    if rng.uniform() < 0.2:
        trousers = shirt
    long_sleeves, long_legs, barefoot = rng.uniform(size=3) < [0.5, 0.7, 0.25]
    loose = rng.uniform(0.0, 0.025, 2) * (rng.uniform(size=2) < 0.7)
    table = np.tile(skin, (len(body.rest_vertices), 1))
    thick = np.zeros(len(table))
    head, waist = body.head_of("head"), body.head_of("root")[2] + dance_floor.WAIST_ABOVE_ROOT
    for index, bone in enumerate(body.dominant_bones()):
        point = body.rest_vertices[index]
        lower = bone.startswith("lowerleg") or bone.startswith("upperleg02")
        if (bone.startswith("spine") and point[2] < waist) or bone.startswith(
            ("upperleg01", "pelvis", "root")
        ):
            table[index], thick[index] = trousers, loose[1] * 0.6
        elif lower and long_legs:
            table[index], thick[index] = trousers, loose[1]
        elif bone.startswith(("spine", "clavicle", "shoulder", "upperarm01")) or (
            bone.startswith(("upperarm02", "lowerarm")) and long_sleeves
        ):
            table[index], thick[index] = shirt, loose[0]
        elif bone.startswith(("foot", "toe")) and not barefoot:
            table[index], thick[index] = shoes, 0.006
        elif bone.startswith("head") and dance_floor._is_hair(point - head):
            table[index], thick[index] = hair, 0.01
        elif bone.startswith("eye"):
            table[index] = dance_floor.EYES
    wave = np.sin(body.rest_vertices @ rng.normal(0.0, rng.choice([3.0, 15.0, 40.0]), (3, 3)))
    pattern = 1.0 + rng.uniform(0.0, 0.4) * wave.mean(1, keepdims=True)
    return np.where(thick[:, None] > 0.0, table * pattern, table).astype(np.float32), thick


def _surface_marks(body: Body) -> dict[str, tuple[str, np.ndarray]]:
    """Return landmarks on the skin: a bone and the point in the rest pose."""
    bones = np.array(body.dominant_bones())
    points = body.rest_vertices
    head = points[bones == "head"]
    centre = body.head_of("head")
    level = head[(head[:, 2] > centre[2]) & (head[:, 2] < centre[2] + 0.12)]
    marks = {"nose": ("head", level[level[:, 1].argmin()])}
    for side, sign, suffix in (("left", 1.0, "L"), ("right", -1.0, "R")):
        marks[f"{side}_ear"] = ("head", level[(sign * level[:, 0]).argmax()])
        foot = points[np.char.startswith(bones, "foot") & np.char.endswith(bones, suffix)]
        toes = points[np.char.startswith(bones, "toe") & np.char.endswith(bones, suffix)]
        marks[f"{side}_heel"] = (f"foot.{suffix}", foot[foot[:, 1].argmax()])
        marks[f"{side}_foot_index"] = (f"toe1-1.{suffix}", toes[toes[:, 1].argmin()])
    return marks
