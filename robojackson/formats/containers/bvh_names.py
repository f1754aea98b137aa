"""HybrIK's 29 keypoints from the joints of any BVH skeleton, by the usual names of its joints.

Known: SMPL, CMU, Mixamo, LAFAN1, 3ds Max's Biped without its prefix, and plain words. A spine of
any number of joints is divided in the proportions of our spine; hands and toes are extended along
their limb where there is no end site. Where a skeleton ends at the ankles, its feet are ours at
rest.
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from robojackson.body.forward_kinematics import unit
from robojackson.body.skeleton import KEYPOINT_NAMES, REST_JOINTS, REST_OFFSETS, keypoint
from robojackson.errors import BadTable
from robojackson.formats.containers.bvh_tree import WHERE, Tree
from robojackson.formats.foreign_motion import listed

NAMES: Mapping[str, tuple[str, ...]] = {
    "pelvis": ("pelvis", "hips", "hip", "root"),
    "neck": ("neck", "neck1", "lowerneck"),
    "head": ("head",),
}
SIDED: Mapping[str, tuple[str, ...]] = {
    "hip": ("hip", "upleg", "thigh", "upperleg"),
    "knee": ("knee", "leg", "shin", "calf", "lowleg", "lowerleg"),
    "ankle": ("ankle", "foot"),
    "foot": ("toebase", "toe", "toes", "ball", "foot"),
    "collar": ("collar", "clavicle", "shoulder"),
    "shoulder": ("uparm", "upperarm", "arm", "shldr", "shoulder"),
    "elbow": ("elbow", "forearm", "lowarm", "lowerarm"),
    "wrist": ("wrist", "hand"),
}
"""Names of a joint without its side, the most specific first; one joint is never used twice."""
NO_FEET = "no feet in the file: invented"
OPTIONAL = {"collar", "foot", "neck"}
SPINE = ("spine1", "spine2", "spine3", "neck")
_ASSIGNED_IN_TURN = ("hip", "knee", "ankle", "foot", "shoulder", "elbow", "wrist", "collar")


def keypoints_of(tree: Tree) -> tuple[Float[np.ndarray, "T 29 3"], tuple[str, ...]]:
    """Return the keypoints, units and axes of the file, and notes.

    Raises:
        BadTable: a required joint is not found.
    """
    where = _find(tree)
    places = tree.positions()
    points = np.zeros((len(places), len(KEYPOINT_NAMES), 3))
    for name, node in where.items():
        points[:, keypoint(name)] = places[:, node]
    if "neck" not in where:
        shoulders = [keypoint("left_shoulder"), keypoint("right_shoulder")]
        points[:, keypoint("neck")] = points[:, shoulders].mean(1)
    _divide_spine(tree, where, places, points)
    has_feet = [_finish_side(tree, where, places, points, side) for side in ("left", "right")]
    top = _tip(tree, where["head"], places)
    size = _rest("head_top") * _metre(points, "left")
    points[:, keypoint("head_top")] = _beyond(points, "neck", "head", size) if top is None else top
    return points, () if all(has_feet) else (NO_FEET,)


def _find(tree: Tree) -> dict[str, int]:
    """Return the node of every keypoint that the file has."""
    plain = {
        _normalised_name(node.name): index for index, node in reversed([*enumerate(tree.nodes)])
    }
    found: dict[str, int] = {}
    entries = list(NAMES.items())
    for bare in _ASSIGNED_IN_TURN:
        for side in ("left", "right"):
            marked = tuple(mark + name for name in SIDED[bare] for mark in (side, side[0]))
            entries.append((f"{side}_{bare}", marked))
    for name, names in entries:
        for candidate in names:
            if candidate in plain and plain[candidate] not in found.values():
                found[name] = plain[candidate]
                break
        else:
            if name.partition("_")[2] not in OPTIONAL and name not in OPTIONAL:
                known = listed([node.name for node in tree.nodes if not node.is_end])
                raise BadTable(f"{WHERE}: no joint for {name!r}. It has: {known}")
    return found


def _normalised_name(name: str) -> str:
    """Return a name in lower case without prefix and separators: mixamorig:LeftUpLeg, leftupleg."""
    return "".join(letter for letter in name.rpartition(":")[2].lower() if letter.isalnum())


def _divide_spine(
    tree: Tree, where: Mapping[str, int], places: np.ndarray, points: np.ndarray
) -> None:
    """Fill in the spine joints at our own shares of the way from the pelvis to the neck."""
    path = [points[:, keypoint("neck")]]
    node = where.get("neck", where["head"])
    while (node := tree.nodes[node].parent) not in (-1, where["pelvis"]):
        path.append(places[:, node])
    line = np.stack([*path, points[:, keypoint("pelvis")]][::-1], 1)
    steps = np.linalg.norm(np.diff(line, axis=1), axis=-1)
    along = np.concatenate([np.zeros((len(steps), 1)), np.cumsum(steps, 1)], 1)
    shares = np.cumsum([np.linalg.norm(REST_OFFSETS[keypoint(name)]) for name in SPINE])
    for name, share in zip(SPINE[:-1], shares / shares[-1], strict=False):
        for frame in range(len(line)):
            at = share * along[frame, -1]
            points[frame, keypoint(name)] = [
                np.interp(at, along[frame], line[frame, :, axis]) for axis in range(3)
            ]


def _finish_side(
    tree: Tree, where: Mapping[str, int], places: np.ndarray, points: np.ndarray, side: str
) -> bool:
    """Fill in collar, hand, middle finger, ball of the foot and toe of one side; return whether the
    file has that foot."""

    def rest(name: str) -> float:
        return _rest(f"{side}_{name}") * metre

    def put(name: str, value: np.ndarray) -> None:
        points[:, keypoint(f"{side}_{name}")] = value

    metre = _metre(points, side)
    if f"{side}_collar" not in where:
        neck, shoulder = points[:, keypoint("neck")], points[:, keypoint(f"{side}_shoulder")]
        put("collar", neck + 0.4 * (shoulder - neck))
    elbow, wrist = f"{side}_elbow", f"{side}_wrist"
    put("hand", _beyond(points, elbow, wrist, rest("hand")))
    put("middle", _beyond(points, elbow, wrist, rest("hand") + rest("middle")))
    if f"{side}_foot" not in where:
        tip = _tip(tree, where[f"{side}_ankle"], places)
        if tip is None:
            ball, toe = _foot_at_rest(points, side, metre)
            put("foot", ball)
            put("big_toe", toe)
            return False
        put("foot", tip)
    tip = _tip(tree, where[f"{side}_foot"], places) if f"{side}_foot" in where else None
    further = _beyond(points, f"{side}_ankle", f"{side}_foot", rest("big_toe"))
    put("big_toe", further if tip is None else tip)
    return True


def _foot_at_rest(
    points: Float[np.ndarray, "T 29 3"], side: str, metre: float
) -> tuple[Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3"]]:
    """Return ball of the foot and toe as they are at rest, seen from the shin and the hips."""
    turn = _shin_frame(points, side) @ np.swapaxes(_shin_frame(REST_JOINTS[None], side), -1, -2)
    ankle, ball, toe = (keypoint(f"{side}_{name}") for name in ("ankle", "foot", "big_toe"))
    to_ball, to_toe = (metre * (REST_JOINTS[end] - REST_JOINTS[ankle]) for end in (ball, toe))
    return points[:, ankle] + turn @ to_ball, points[:, ankle] + turn @ to_toe


def _shin_frame(points: Float[np.ndarray, "T 29 3"], side: str) -> Float[np.ndarray, "T 3 3"]:
    """Return axes in columns: ahead and to the left of the shin, by the line of the hips, and down
    along it."""
    down = unit(points[:, keypoint(f"{side}_ankle")] - points[:, keypoint(f"{side}_knee")])
    left = points[:, keypoint("left_hip")] - points[:, keypoint("right_hip")]
    ahead = unit(np.cross(down, left))
    return np.stack([ahead, np.cross(ahead, down), down], -1)


def _rest(name: str) -> float:
    """Return the length of our own bone, metres."""
    return float(np.linalg.norm(REST_OFFSETS[keypoint(name)]))


def _metre(points: np.ndarray, side: str) -> float:
    """Return the units of the file in a metre of our skeleton, by the thigh."""
    thigh = points[:, keypoint(f"{side}_knee")] - points[:, keypoint(f"{side}_hip")]
    return float(np.median(np.linalg.norm(thigh, axis=-1))) / _rest(f"{side}_knee")


def _tip(tree: Tree, node: int, places: np.ndarray) -> np.ndarray | None:
    """Return the end site of a joint, where it differs from the joint itself."""
    for index, other in enumerate(tree.nodes):
        if other.parent == node and other.is_end and np.linalg.norm(other.offset) > 0.0:
            return np.asarray(places[:, index])
    return None


def _beyond(points: np.ndarray, start: str, end: str, length: float) -> np.ndarray:
    """Return a point further along a bone."""
    a, b = points[:, keypoint(start)], points[:, keypoint(end)]
    return np.asarray(b + unit(b - a) * length)
