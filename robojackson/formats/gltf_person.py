"""A person's motion as glTF: SMPL's 24 joints as a skeleton, and a skinned body of rounded parts.

The rest pose is ours (T-pose, y up, z forward, metres), in which the skin is bound; the joints turn
by key frames. Blender imports it as an armature.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from robojackson.body.forward_kinematics import swing
from robojackson.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, PARENTS, part_radius, side_of
from robojackson.formats.containers.gltf_scene import WORLD_TO_GLTF, GltfScene
from robojackson.formats.foreign_motion import turned_root
from robojackson.formats.format import PersonExporter
from robojackson.geometry.rotations import from_rotation
from robojackson.geometry.surface import Surface, capsule
from robojackson.motion.smpl_sequence import SmplSequence

COLOURS = {"left": (0.25, 0.49, 0.94), "right": (0.94, 0.54, 0.18), "middle": (0.81, 0.84, 0.90)}


def write(sequence: SmplSequence) -> bytes:
    """Return the .glb of a motion."""
    scene = GltfScene("person")
    clock = scene.clock(np.arange(len(sequence)) / sequence.fps)
    add_person(scene, sequence, np.arange(len(sequence)), clock)
    return scene.to_bytes()


def add_person(
    scene: GltfScene,
    sequence: SmplSequence,
    frames: Int[np.ndarray, " T"],
    clock: int,
    aside_m: float = 0.0,
) -> None:
    """Add a moving person.

    Args:
        frames: The frame at every key frame of the clock.
        aside_m: How far to its left the person is put.
    """
    rest = np.asarray(sequence.rest_joints, float)
    root, pelvis = turned_root(sequence, WORLD_TO_GLTF)
    vectors = np.concatenate([root, sequence.body_pose], axis=1).reshape(len(sequence), -1, 3)
    person, nodes = scene.node("person"), list[int]()
    for joint, name in enumerate(JOINT_NAMES):
        parent = PARENTS[joint]
        offset = rest[joint] - rest[parent] if joint else rest[0]
        nodes.append(scene.node(name, nodes[parent] if joint else person, place=offset))
        turns = from_rotation(Rotation.from_rotvec(vectors[frames, joint]))
        moved = pelvis[frames] + WORLD_TO_GLTF @ [0.0, aside_m, 0.0] if joint == 0 else None
        scene.animate(nodes[joint], clock, moved, turns)
    skin = scene.skin("person", nodes, rest[: len(nodes)])
    scene.node("person body", mesh=_body(scene, rest), skin=skin)


def _body(scene: GltfScene, rest: Float[np.ndarray, "29 3"]) -> int:
    """Add the parts of a body in its rest pose; each follows the joint at which it begins."""
    materials = {side: scene.material(side, rgb) for side, rgb in COLOURS.items()}
    parts, joints = [], []
    for side, material in materials.items():
        ends = [
            k for k, name in enumerate(KEYPOINT_NAMES) if PARENTS[k] >= 0 and side_of(name) == side
        ]
        pieces = [_part(rest[PARENTS[k]], rest[k], part_radius(KEYPOINT_NAMES[k])) for k in ends]
        parts.append((_joined(pieces), material))
        joints.append(np.repeat([PARENTS[k] for k in ends], [len(p.vertices) for p in pieces]))
    return scene.mesh("person", parts, joints)


def _part(start: Float[np.ndarray, "3"], end: Float[np.ndarray, "3"], radius: float) -> Surface:
    """Return a capsule from one point to another."""
    along = end - start
    turn = Rotation.from_matrix(swing(np.array([0.0, 0.0, 1.0]), along))
    made = capsule(radius, float(np.linalg.norm(along)) / 2)
    vertices = turn.apply(made.vertices) + (start + end) / 2
    return Surface(vertices, turn.apply(made.normals), made.faces)


def _joined(pieces: list[Surface]) -> Surface:
    """Return several surfaces as one."""
    first = np.cumsum([0, *(len(piece.vertices) for piece in pieces[:-1])])
    return Surface(
        np.concatenate([piece.vertices for piece in pieces]),
        np.concatenate([piece.normals for piece in pieces]),
        np.concatenate([piece.faces + at for piece, at in zip(pieces, first, strict=True)]),
    )


EXPORT = PersonExporter("gltf", write)
