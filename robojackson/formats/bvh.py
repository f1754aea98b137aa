"""BVH: written with SMPL's 24 joints in centimetres, y up; read from any skeleton with usual names.

A file with SMPL's names poses its own skeleton. Of another skeleton (CMU, Mixamo, LAFAN1, ...) the
positions are taken and HybrIK's solve finds the rotations; fingers are left out.
"""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from robojackson.body import analytic_solve
from robojackson.body.flat_feet import with_flat_soles
from robojackson.body.forward_kinematics import apply, unit
from robojackson.body.skeleton import (
    JOINT_NAMES,
    KEYPOINT_NAMES,
    PARENTS,
    REST_OFFSETS,
    assemble,
    keypoint,
    pair,
)
from robojackson.errors import BadTable
from robojackson.formats.containers.bvh_faults import mended
from robojackson.formats.containers.bvh_names import keypoints_of
from robojackson.formats.containers.bvh_tree import WHERE, Node, Tree, parse
from robojackson.formats.foreign_motion import (
    Y_UP_TO_WORLD,
    ForeignMotion,
    skeleton_under,
    turned_root,
)
from robojackson.formats.format import Importer, PersonExporter
from robojackson.motion.smpl_sequence import SmplSequence

CENTIMETRE = 0.01
UNITS = (1.0, CENTIMETRE, 0.001, 0.0254, 0.0254 / 0.45)
"""Candidate units of length in metres; the last is that of the CMU files."""
LEG = (0.55, 1.15)
"""Typical leg length (hip to ankle), metres."""
CHILDS_LEG = 0.2
"""Shortest leg length of a walking person, metres."""
USUAL_LEG = 0.82
ROUNDS = 3
"""Iterations in which rotations and skeleton are found from each other."""
ORDER = "ZXY"
_ENDS = {parent: index for index, parent in enumerate(PARENTS) if index >= len(JOINT_NAMES)}


def write(sequence: SmplSequence) -> bytes:
    """Return the BVH of a motion: rotations Z, X, Y in degrees, positions in centimetres."""
    rest = sequence.rest_joints / CENTIMETRE
    lines = ["HIERARCHY"]
    order: list[int] = []
    _branch(0, rest, 0, lines, order)
    root, pelvis = turned_root(sequence, Y_UP_TO_WORLD.T)
    vectors = np.concatenate([root, sequence.body_pose], axis=1).reshape(-1, 3)
    angles = Rotation.from_rotvec(vectors).as_euler(ORDER, degrees=True)
    angles = _without_jumps(angles.reshape(len(sequence), -1, 3))
    angles = angles[:, order].reshape(len(sequence), -1)
    table = np.concatenate([pelvis / CENTIMETRE, angles], axis=1)
    lines += ["MOTION", f"Frames: {len(sequence)}", f"Frame Time: {1.0 / sequence.fps:.10f}"]
    lines += [" ".join(f"{number:.7f}" for number in row) for row in table]
    return ("\n".join(lines) + "\n").encode()


def _without_jumps(angles: Float[np.ndarray, "T J 3"]) -> Float[np.ndarray, "T J 3"]:
    """Return angles of the same rotations, degrees, each the nearest to those of the frame before:
    programs that resample curves would turn a joint the long way round between two frames.

    Angles (a, b, c) about three different axes and (a + 180, 180 - b, c + 180) are one rotation.
    """
    result = np.array(angles)
    for frame in range(1, len(result)):
        before = result[frame - 1]
        same = result[frame], result[frame] * [1, -1, 1] + 180.0
        near = np.stack([each - 360.0 * np.round((each - before) / 360.0) for each in same])
        best = np.abs(near - before).sum(-1).argmin(0)
        result[frame] = near[best, np.arange(near.shape[1])]
    return result


def _branch(index: int, rest: np.ndarray, depth: int, lines: list[str], order: list[int]) -> None:
    """Append one joint and all below it; `order` collects the joints in the order of the file."""
    order.append(index)
    pad, inner = "  " * depth, "  " * (depth + 1)
    channels = " ".join(f"{axis}rotation" for axis in ORDER)
    places = "Xposition Yposition Zposition " if index == 0 else ""
    offset = rest[index] - rest[PARENTS[index]] if index else np.zeros(3)
    lines += [f"{pad}{'JOINT' if index else 'ROOT'} {KEYPOINT_NAMES[index]}", f"{pad}{{"]
    lines += [_offset(inner, offset), f"{inner}CHANNELS {3 if index else 6} {places}{channels}"]
    for child, parent in enumerate(PARENTS[: len(JOINT_NAMES)]):
        if parent == index:
            _branch(child, rest, depth + 1, lines, order)
    if index in _ENDS:
        tip = rest[_ENDS[index]] - rest[index]
        lines += [f"{inner}End Site", f"{inner}{{", _offset(inner + "  ", tip), f"{inner}}}"]
    lines.append(f"{pad}}}")


def _offset(pad: str, offset: np.ndarray) -> str:
    return f"{pad}OFFSET " + " ".join(f"{number:.7f}" for number in offset)


def read(data: bytes) -> ForeignMotion:
    """Return the motion of a BVH, y up.

    Raises:
        BadTable: not a BVH, or one in which no person can be found.
    """
    tree = parse(data)
    names = [node.name for node in tree.nodes]
    if set(JOINT_NAMES) <= set(names):
        return _own(tree, names)
    return _other(tree)


def _own(tree: Tree, names: list[str]) -> ForeignMotion:
    """Return the motion of a skeleton with SMPL's joints, whose rest pose is turned to SMPL's axes:
    Blender's has z up."""
    nodes = [names.index(name) for name in JOINT_NAMES]
    offsets = np.array(REST_OFFSETS)
    given = np.zeros((len(nodes), 3))
    for index, at in enumerate(nodes):
        _require_parent(tree.nodes[at], names, index)
        given[index] = tree.nodes[at].offset
    given[0] = 0.0
    turn = _to_rest_axes(given)
    offsets[: len(nodes)] = given @ turn.T
    for parent, tip in _ENDS.items():
        if (end := f"{JOINT_NAMES[parent]}_end") in names:
            offsets[tip] = tree.nodes[names.index(end)].offset @ turn.T
    rest = assemble(offsets)
    metre, notes = _unit(rest, ours=True)
    rotations = tree.rotations()[:, nodes] @ turn.T
    rotations[:, 1:] = turn @ rotations[:, 1:]  # the root's goes to the axes of the file
    return ForeignMotion(
        fps=tree.fps,
        rotations=rotations,
        pelvis=tree.root() * metre,
        rest_joints=rest * metre,
        to_world=Y_UP_TO_WORLD.copy(),
        notes=notes,
    )


def _to_rest_axes(offsets: Float[np.ndarray, "24 3"]) -> Float[np.ndarray, "3 3"]:
    """Return the turn, by quarters, that takes bones of a rest pose nearest to SMPL's."""
    turns = Rotation.create_group("O").as_matrix().round()
    near = np.einsum("gij,nj,ni->g", turns, offsets, REST_OFFSETS[: len(offsets)])
    nearest: np.ndarray = turns[near.argmax()]
    return nearest


def _require_parent(node: Node, names: list[str], index: int) -> None:
    parent = JOINT_NAMES[PARENTS[index]] if index else None
    found = names[node.parent] if node.parent >= 0 else None
    if found != parent:
        raise BadTable(
            f"{WHERE}: the parent of {node.name} is {found}; in SMPL's tree it is {parent}"
        )


def _other(tree: Tree) -> ForeignMotion:
    """Return the motion of any other skeleton, solved from the positions of its joints."""
    points, invented = keypoints_of(tree)
    lengths = np.zeros(len(PARENTS))
    for index, parent in enumerate(PARENTS[1:], start=1):
        lengths[index] = np.median(np.linalg.norm(points[:, index] - points[:, parent], axis=-1))
    usual = np.maximum(np.linalg.norm(REST_OFFSETS, axis=-1), 1e-9)
    rest = assemble(REST_OFFSETS * (lengths / usual)[:, None])
    metre, notes = _unit(rest)
    points, rest = points * metre, rest * metre
    points, faults = mended(points, tree.fps)
    notes = (*invented, *notes, *faults)
    if len(points) > 1:
        points, angles = with_flat_soles(points, tree.fps)
        if (turned := np.degrees(angles).round()).any():
            by = " and ".join(f"{angle:.0f}" for angle in turned)
            notes = (*notes, f"feet turned by {by} degrees to flat soles")
    for _ in range(ROUNDS):
        rotations = analytic_solve.solve_with(points, rest[None], _chest_twist(points, rest))
        rest = skeleton_under(rotations, points)
    return ForeignMotion(
        fps=tree.fps,
        rotations=analytic_solve.solve_with(points, rest[None], _chest_twist(points, rest)),
        pelvis=points[:, 0],
        rest_joints=rest,
        to_world=Y_UP_TO_WORLD.copy(),
        notes=("another skeleton than SMPL's: positions kept, twists of the limbs not", *notes),
    )


def _chest_twist(points: np.ndarray, rest: np.ndarray) -> analytic_solve.TwistRule:
    """Turn the chest until its collars match; twist no other joint."""
    chest, (left, right) = keypoint("spine3"), pair("collar")
    axis = unit(rest[keypoint("neck")] - rest[chest])
    line = unit(points[:, left] - points[:, right])
    before = rest[left] - rest[right]

    def rule(joint: int, swung: np.ndarray) -> np.ndarray:
        if joint != chest:
            return np.tile([1.0, 0.0], (len(points), 1))
        after = apply(np.swapaxes(swung, -1, -2), line)
        sine = np.sum(np.cross(before, after) * axis, -1)
        cosine = np.sum(before * after, -1) - (before @ axis) * (after @ axis)
        return np.stack([cosine, sine], -1)

    return rule


def _unit(rest: Float[np.ndarray, "29 3"], ours: bool = False) -> tuple[float, tuple[str, ...]]:
    """Return the metres in a unit of the file, chosen so that the legs have a person's length, and
    notes. Our own files are in centimetres.
    """
    bones = [("left_knee", "left_hip"), ("left_ankle", "left_knee")]
    leg = sum(float(np.linalg.norm(rest[keypoint(a)] - rest[keypoint(b)])) for a, b in bones)
    if not np.isfinite(leg) or leg <= 0.0:
        raise BadTable(f"{WHERE}: the legs have no length")
    if ours and CHILDS_LEG <= leg * CENTIMETRE <= LEG[1]:
        return CENTIMETRE, ()
    for metre in UNITS:
        if LEG[0] <= leg * metre <= LEG[1]:
            usual = metre in (1.0, CENTIMETRE)
            return metre, () if usual else (f"unknown unit: taken for {1e3 * metre:.4g} mm",)
    return USUAL_LEG / leg, (f"unknown unit: scaled to legs of {USUAL_LEG} m",)


EXPORT = PersonExporter("bvh", write)
IMPORT = Importer("bvh", read, lambda file: file.head.startswith(b"HIERARCHY"))
