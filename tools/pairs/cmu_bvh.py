"""CMU motion capture in BVH to DeepMimic's thirteen rotations.

Of the file: x to the person's left, y up, z forward, rest pose a T; lengths in its own unit.
"""

import gzip
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tools.render import deepmimic

TO_DEEPMIMIC = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
DOWN = np.array([0.0, -1.0, 0.0])
FOLLOWS: Mapping[str, tuple[str, str | None]] = {
    "root": ("Hips", None),
    "chest": ("Spine1", None),
    "neck": ("Head", None),
    "left_hip": ("LeftUpLeg", "LeftLeg"),
    "left_knee": ("LeftLeg", "LeftFoot"),
    "left_ankle": ("LeftFoot", None),
    "left_shoulder": ("LeftArm", "LeftForeArm"),
    "left_elbow": ("LeftForeArm", "LeftHand"),
    "right_hip": ("RightUpLeg", "RightLeg"),
    "right_knee": ("RightLeg", "RightFoot"),
    "right_ankle": ("RightFoot", None),
    "right_shoulder": ("RightArm", "RightForeArm"),
    "right_elbow": ("RightForeArm", "RightHand"),
}
"""Joint -> node of the file, and the node whose offset is the rest direction of the limb."""


@dataclass(frozen=True)
class Node:
    """One joint of the file; `columns` is where its channels begin."""

    parent: str | None
    offset: np.ndarray
    channels: tuple[str, ...]
    columns: int


def read(path: Path) -> deepmimic.Motion:
    """Return the whole file but its first frame, which is a T-pose beside the motion."""
    content = path.read_bytes()
    text = (gzip.decompress(content) if path.suffix == ".gz" else content).decode()
    header, _, body = text.partition("MOTION")
    nodes = _nodes(header.split())
    lines = body.strip().splitlines()
    fps = 1.0 / float(lines[1].split()[-1])
    table = np.array([line.split() for line in lines[2:] if line.strip()], float)[1:]
    world = _rotations(nodes, table)
    leg = sum(float(np.linalg.norm(nodes[name].offset)) for name in ("LeftLeg", "LeftFoot"))
    scale = (deepmimic.THIGH_LENGTH + deepmimic.SHIN_LENGTH) / leg
    rotations = {
        joint: _turned(world[node], nodes[limb].offset if limb else None)
        for joint, (node, limb) in FOLLOWS.items()
    }
    return deepmimic.Motion(fps, table[:, :3] * scale @ TO_DEEPMIMIC.T, rotations)


def _nodes(words: list[str]) -> dict[str, Node]:
    nodes: dict[str, Node] = {}
    parents: list[str | None] = []
    name, offset, column = "", np.zeros(3), 0
    for index, word in enumerate(words):
        if word in ("ROOT", "JOINT", "End"):
            name = words[index + 1] if word != "End" else f"{name}.end"
        elif word == "{":
            parents.append(name)
        elif word == "}":
            parents.pop()
        elif word == "OFFSET":
            offset = np.array(words[index + 1 : index + 4], float)
        elif word == "CHANNELS":
            count = int(words[index + 1])
            channels = tuple(words[index + 2 : index + 2 + count])
            nodes[name] = Node(parents[-2] if len(parents) > 1 else None, offset, channels, column)
            column += count
    return nodes


def _rotations(nodes: Mapping[str, Node], table: np.ndarray) -> dict[str, Rotation]:
    world: dict[str, Rotation] = {}
    for name, node in nodes.items():
        turns = [(k, c[0]) for k, c in enumerate(node.channels) if c.endswith("rotation")]
        angles = table[:, [node.columns + k for k, _ in turns]]
        local = Rotation.from_euler("".join(axis for _, axis in turns), angles, degrees=True)
        world[name] = world[node.parent] * local if node.parent else local
    return world


def _turned(world: Rotation, limb: np.ndarray | None) -> Rotation:
    """Return the rotation from the file's axes to DeepMimic's; a limb at rest hangs down."""
    rest = Rotation.identity()
    if limb is not None:
        rest, _ = Rotation.align_vectors([limb / np.linalg.norm(limb)], [DOWN])
    return Rotation.from_matrix(TO_DEEPMIMIC @ (world * rest).as_matrix() @ TO_DEEPMIMIC.T)
