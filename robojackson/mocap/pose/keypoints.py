"""From BlazePose landmarks to HybrIK's 29 keypoints: fixed definitions, not fitted to a clip.

Limb joints are landmarks. Pelvis, chest, head, hands and feet are frames built from several
landmarks; the spine is a smooth curve between pelvis and neck. Metres, any right-handed frame.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from robojackson.body.forward_kinematics import align, apply, kabsch, unit
from robojackson.body.skeleton import REST_JOINTS, keypoint, pair
from robojackson.mocap.landmarks.blazepose import landmark

LEFT = np.array([1.0, 0.0, 0.0])
UP = np.array([0.0, 1.0, 0.0])
FACE = {
    "left_ear": (0.075, 0.0, 0.0),
    "right_ear": (-0.075, 0.0, 0.0),
    "nose": (0.0, -0.01, 0.12),
    "mouth_left": (0.025, -0.07, 0.095),
    "mouth_right": (-0.025, -0.07, 0.095),
    "left_eye": (0.032, 0.03, 0.09),
    "right_eye": (-0.032, 0.03, 0.09),
}
"""A rounded adult face about the middle of the ears, metres, axes of the rest pose."""
EARS_ABOVE_HEAD = np.array([0.0, 0.08, 0.02])
"""Middle of the ears from the head's joint, metres: the joint is the skull's centre of rotation."""

Mark = Callable[[str], np.ndarray]


@dataclass(frozen=True)
class Keypoints:
    """Targets of the solve.

    Attributes:
        points: Positions, metres.
        pelvis, chest, head: Rotations from the rest pose.
        confidence: Visibility of the landmarks of a point, 0..1.
    """

    points: Float[np.ndarray, "T 29 3"]
    pelvis: Float[np.ndarray, "T 3 3"]
    chest: Float[np.ndarray, "T 3 3"]
    head: Float[np.ndarray, "T 3 3"]
    confidence: Float[np.ndarray, "T 29"]


def build(
    landmarks: Float[np.ndarray, "T 33 3"],
    visibility: Float[np.ndarray, "T 33"],
    rest_joints: Float[np.ndarray, "29 3"] = REST_JOINTS,
) -> Keypoints:
    """Return the 29 keypoints of every frame."""

    def mark(name: str) -> np.ndarray:
        return landmarks[:, landmark(name)]

    points = np.full((len(landmarks), 29, 3), np.nan)
    pelvis, chest = _trunk(mark, points, rest_joints)
    head = _head(mark, points, rest_joints)
    for side in ("left", "right"):
        _limbs(mark, points, rest_joints, side)
    return Keypoints(points, pelvis, chest, head, _confidence(visibility))


def _trunk(
    mark: Mark, points: np.ndarray, rest: np.ndarray
) -> tuple[Float[np.ndarray, "T 3 3"], Float[np.ndarray, "T 3 3"]]:
    """Place pelvis, hips, spine, neck, collars and shoulders; return pelvis and chest frames."""
    hips, shoulders = pair("hip"), pair("shoulder")
    low, high = _middle(mark, "hip"), _middle(mark, "shoulder")
    rest_low, rest_high = rest[list(hips)].mean(0), rest[list(shoulders)].mean(0)
    trunk = (high - low, rest_high - rest_low)
    pelvis = align((LEFT, trunk[1]), (mark("left_hip") - mark("right_hip"), trunk[0]))
    chest = align((LEFT, trunk[1]), (mark("left_shoulder") - mark("right_shoulder"), trunk[0]))
    root, neck = keypoint("pelvis"), keypoint("neck")
    points[:, root] = low + apply(pelvis, rest[root] - rest_low)
    for index in (*hips, keypoint("spine1")):
        points[:, index] = points[:, root] + apply(pelvis, rest[index] - rest[root])
    points[:, neck] = high + apply(chest, rest[neck] - rest_high)
    _spine(points, rest, pelvis, chest)
    for index in pair("collar"):
        spine3 = keypoint("spine3")
        points[:, index] = points[:, spine3] + apply(chest, rest[index] - rest[spine3])
    points[:, shoulders[0]], points[:, shoulders[1]] = mark("left_shoulder"), mark("right_shoulder")
    return pelvis, chest


def _spine(points: np.ndarray, rest: np.ndarray, pelvis: np.ndarray, chest: np.ndarray) -> None:
    """Place spine2 and spine3 on the cubic Hermite curve from spine1 to neck, by rest length."""
    names = ("spine1", "spine2", "spine3", "neck")
    chain = [keypoint(name) for name in names]
    lengths = np.linalg.norm(np.diff(rest[chain], axis=0), axis=-1)
    fractions = np.cumsum(lengths) / lengths.sum()
    start, end = points[:, chain[0]], points[:, chain[-1]]
    span = np.linalg.norm(end - start, axis=-1, keepdims=True)
    leave, arrive = apply(pelvis, UP) * span, apply(chest, UP) * span
    for index, s in zip(chain[1:3], fractions[:2], strict=True):
        points[:, index] = (
            (2 * s**3 - 3 * s**2 + 1) * start
            + (s**3 - 2 * s**2 + s) * leave
            + (3 * s**2 - 2 * s**3) * end
            + (s**3 - s**2) * arrive
        )


def _head(mark: Mark, points: np.ndarray, rest: np.ndarray) -> Float[np.ndarray, "T 3 3"]:
    """Place head and head top by the Kabsch fit of a face to ears, eyes, nose and mouth."""
    seen = np.stack([mark(name) for name in FACE], 1)
    model = np.array(list(FACE.values()))
    head = kabsch(model - model.mean(0), seen - seen.mean(1, keepdims=True))
    joint, top = keypoint("head"), keypoint("head_top")
    points[:, joint] = _middle(mark, "ear") - apply(head, EARS_ABOVE_HEAD)
    points[:, top] = points[:, joint] + apply(head, rest[top] - rest[joint])
    return head


def _limbs(mark: Mark, points: np.ndarray, rest: np.ndarray, side: str) -> None:
    for name in ("elbow", "wrist", "knee", "ankle"):
        points[:, keypoint(f"{side}_{name}")] = mark(f"{side}_{name}")
    knuckles = (mark(f"{side}_index") + mark(f"{side}_pinky")) / 2.0
    along = unit(knuckles - mark(f"{side}_wrist"))
    _extend(points, rest, mark(f"{side}_wrist"), along, f"{side}_wrist", f"{side}_hand")
    _extend(points, rest, mark(f"{side}_wrist"), along, f"{side}_wrist", f"{side}_middle")
    ankle, toe = keypoint(f"{side}_ankle"), keypoint(f"{side}_big_toe")
    shin = mark(f"{side}_knee") - mark(f"{side}_ankle")
    rest_shin = rest[keypoint(f"{side}_knee")] - rest[ankle]
    foot = align(
        (rest[toe] - rest[ankle], rest_shin),
        (mark(f"{side}_foot_index") - mark(f"{side}_ankle"), shin),
    )
    for index in (keypoint(f"{side}_foot"), toe):
        points[:, index] = points[:, ankle] + apply(foot, rest[index] - rest[ankle])


def _extend(
    points: np.ndarray, rest: np.ndarray, start: np.ndarray, along: np.ndarray, a: str, b: str
) -> None:
    length = np.linalg.norm(rest[keypoint(b)] - rest[keypoint(a)])
    points[:, keypoint(b)] = start + along * length


def _middle(mark: Mark, name: str) -> np.ndarray:
    return (mark(f"left_{name}") + mark(f"right_{name}")) / 2.0


def _confidence(visibility: np.ndarray) -> Float[np.ndarray, "T 29"]:
    """Return the least visibility of the landmarks of a point; of the trunk's four corners for the
    trunk."""
    corners = [landmark(f"{s}_{n}") for s in ("left", "right") for n in ("hip", "shoulder")]
    result = np.repeat(visibility[:, corners].min(1)[:, None], 29, axis=1)
    sources = {
        "shoulder": "shoulder", "elbow": "elbow", "wrist": "wrist", "hand": "index",
        "middle": "index", "knee": "knee", "ankle": "ankle", "foot": "foot_index",
        "big_toe": "foot_index",
    }  # fmt: skip
    for side in ("left", "right"):
        for name, source in sources.items():
            column = keypoint(f"{side}_{name}")
            result[:, column] = visibility[:, landmark(f"{side}_{source}")]
    for name in ("head", "head_top"):
        result[:, keypoint(name)] = visibility[:, landmark("nose")]
    answer: np.ndarray = np.clip(result, 0.0, 1.0)
    return answer
