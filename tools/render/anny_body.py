"""A parametric human body (Anny) put into the poses of a motion file.

Anny's world: x left, y backward (the body faces -y), z up; metres. Its 104 bones are posed by world
orientations: limbs point along the motion's limbs for any rest pose, the spine and
neck share the bend between their ends.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from tools.render import deepmimic

DANCER: Mapping[str, float] = {
    "gender": 0.0, "age": 0.66, "height": 0.45, "weight": 0.4, "muscle": 0.6,
}  # fmt: skip
"""Anny's phenotype of the bundled dancers, 0..1 each (gender 0 is male, age 0.66 an adult)."""

DEEPMIMIC_TO_ANNY = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
LIMBS: Mapping[str, tuple[str, str]] = {
    "upperleg": ("upperleg01", "lowerleg01"),
    "lowerleg": ("lowerleg01", "foot"),
    "upperarm": ("upperarm01", "lowerarm01"),
    "lowerarm": ("lowerarm01", "wrist"),
}
"""Bones whose rest direction is turned straight down before the motion's rotation is applied."""
FOLLOWS: Mapping[str, tuple[str, str | None]] = {
    "upperleg": ("hip", "upperleg"),
    "lowerleg": ("knee", "lowerleg"),
    "foot": ("ankle", None),
    "toe": ("ankle", None),
    "upperarm": ("shoulder", "upperarm"),
    "lowerarm": ("elbow", "lowerarm"),
    "wrist": ("elbow", "lowerarm"),
    "finger": ("elbow", "lowerarm"),
    "metacarpal": ("elbow", "lowerarm"),
}
"""Bone prefix -> joint of the motion that it turns with, limb whose rest direction counts."""
SPINE_SHARE: Mapping[str, float] = {"spine05": 0.0, "spine04": 0.4, "spine03": 0.7}
NECK_SHARE: Mapping[str, float] = {"neck01": 0.33, "neck02": 0.66}
CHEST_PREFIXES = ("spine01", "spine02", "clavicle", "shoulder")
HEAD_PREFIXES = ("neck", "head", "eye", "tongue", "jaw")
JOINT_BONES: Mapping[str, str] = {
    "L_Hip": "upperleg01.L", "R_Hip": "upperleg01.R",
    "L_Knee": "lowerleg01.L", "R_Knee": "lowerleg01.R",
    "L_Ankle": "foot.L", "R_Ankle": "foot.R",
    "L_Shoulder": "upperarm01.L", "R_Shoulder": "upperarm01.R",
    "L_Elbow": "lowerarm01.L", "R_Elbow": "lowerarm01.R",
    "L_Wrist": "wrist.L", "R_Wrist": "wrist.R",
}  # fmt: skip
"""The twelve joints of the ground truth, in its order."""
BATCH = 32
FLOOR_SMOOTHING = 5.0
"""Frames; the floor is the lowest point of the smoothed height of the lowest vertex."""


@dataclass(frozen=True)
class PosedBody:
    """The body in every frame, its lowest point on the floor z = 0.

    Attributes:
        vertices: Skin, metres.
        bones: Bone heads, metres.
        triangles: Vertex indices.
    """

    vertices: Float[np.ndarray, "T V 3"]
    bones: Float[np.ndarray, "T B 3"]
    triangles: Int[np.ndarray, "F 3"]


class Body:
    """One person: Anny's model with a phenotype."""

    def __init__(self, phenotype: Mapping[str, float] = DANCER, model: Any = None) -> None:
        import anny  # of tools/requirements.txt; a test that needs no body runs without it

        self.model: Any = model or anny.Anny().to(torch.float32)
        self.phenotype = dict(phenotype)
        self.bone_names: list[str] = [str(name) for name in self.model.bone_labels]
        rest = self.model(phenotype_kwargs=self.phenotype)
        self.rest_bones: Float[np.ndarray, "B 4 4"] = rest["rest_bone_poses"][0].numpy()
        self.rest_vertices: Float[np.ndarray, "V 3"] = rest["rest_vertices"][0].numpy()
        self.triangles = np.asarray(self.model.get_triangular_faces()).astype(np.int32)

    def head_of(self, bone: str) -> Float[np.ndarray, "3"]:
        """Return where a bone begins in the rest pose, metres."""
        return self.rest_bones[self.bone_names.index(bone), :3, 3]

    @property
    def scale(self) -> float:
        """Leg length over that of the motion file's humanoid."""
        leg = self._length("upperleg01.L", "lowerleg01.L") + self._length("lowerleg01.L", "foot.L")
        return leg / (deepmimic.THIGH_LENGTH + deepmimic.SHIN_LENGTH)

    def dominant_bones(self) -> list[str]:
        """Return the bone with the greatest skinning weight, one a vertex."""
        weights = self.model.vertex_bone_weights.numpy()
        indices = self.model.vertex_bone_indices.numpy()
        return [self.bone_names[i] for i in indices[np.arange(len(indices)), weights.argmax(1)]]

    def posed(self, motion: deepmimic.Motion) -> PosedBody:
        """Return the body in the poses of a motion, standing on the floor."""
        poses = self._bone_poses(motion)
        vertices, bones = zip(*(self._skinned(part) for part in _batches(poses)), strict=True)
        v, b = np.concatenate(vertices), np.concatenate(bones)
        lowest = gaussian_filter1d(v[:, :, 2].min(1), FLOOR_SMOOTHING, mode="nearest").min()
        floor = np.array([0.0, 0.0, lowest], dtype=np.float32)
        return PosedBody(v - floor, b - floor, self.triangles)

    def _bone_poses(self, motion: deepmimic.Motion) -> Float[np.ndarray, "T B 4 4"]:
        poses = np.zeros((len(motion), len(self.bone_names), 4, 4), np.float32)
        poses[:, :, 3, 3] = 1.0
        for index, bone in enumerate(self.bone_names):
            rest = self.rest_bones[index, :3, :3]
            poses[:, index, :3, :3] = self._world_rotation(bone, motion.rotations) @ rest
        poses[:, 0, :3, 3] = motion.root_position @ DEEPMIMIC_TO_ANNY.T * self.scale
        return poses

    def _world_rotation(
        self, bone: str, rotations: Mapping[str, Rotation]
    ) -> Float[np.ndarray, "T 3 3"]:
        """Return the rotation from the rest pose to the motion's pose, Anny's axes."""
        base, _, suffix = bone.partition(".")
        side = {"L": "left", "R": "right"}.get(suffix, "")
        for prefix, (joint, limb) in FOLLOWS.items():
            if base.startswith(prefix):
                straighten = np.eye(3) if limb is None else self._to_straight_down(limb, suffix)
                return _to_anny(rotations[f"{side}_{joint}"]) @ straighten
        return _to_anny(_trunk_rotation(base, rotations))

    def _to_straight_down(self, limb: str, suffix: str) -> Float[np.ndarray, "3 3"]:
        start, end = LIMBS[limb]
        direction = self.head_of(f"{end}.{suffix}") - self.head_of(f"{start}.{suffix}")
        direction = direction / np.linalg.norm(direction)
        down = np.array([0.0, 0.0, -1.0])
        axis = np.cross(direction, down)
        sine = np.linalg.norm(axis)
        angle = np.arctan2(sine, direction @ down)
        return Rotation.from_rotvec(axis / max(sine, 1e-12) * angle).as_matrix()

    def _skinned(self, poses: Float[np.ndarray, "T B 4 4"]) -> tuple[np.ndarray, np.ndarray]:
        with torch.no_grad():
            out = self.model(
                pose_parameters=torch.from_numpy(poses),
                phenotype_kwargs=self.phenotype,
                pose_parameterization="world-orient",
            )
        return out["vertices"].numpy(), out["bone_poses"].numpy()[:, :, :3, 3]

    def _length(self, start: str, end: str) -> float:
        return float(np.linalg.norm(self.head_of(end) - self.head_of(start)))


def _trunk_rotation(base: str, rotations: Mapping[str, Rotation]) -> Rotation:
    if base.startswith(CHEST_PREFIXES):
        return rotations["chest"]
    if base.startswith(HEAD_PREFIXES):
        return _between(rotations["chest"], rotations["neck"], NECK_SHARE.get(base, 1.0))
    if base.startswith("spine"):
        return _between(rotations["root"], rotations["chest"], SPINE_SHARE[base])
    return rotations["root"]


def _between(a: Rotation, b: Rotation, share: float) -> Rotation:
    return a * Rotation.from_rotvec((a.inv() * b).as_rotvec() * share)


def _to_anny(rotation: Rotation) -> Float[np.ndarray, "T 3 3"]:
    return DEEPMIMIC_TO_ANNY @ rotation.as_matrix() @ DEEPMIMIC_TO_ANNY.T


def _batches(poses: np.ndarray) -> list[np.ndarray]:
    return [poses[start : start + BATCH] for start in range(0, len(poses), BATCH)]
