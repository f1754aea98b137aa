"""BlazePose's 33 landmarks: their names, and the repair of gaps and of swapped sides.

Left and right are the subject's. A gap is a run of frames without a detected person.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from robojackson.body.forward_kinematics import unit
from robojackson.clips.people.camera_path import warp
from robojackson.errors import NoPersonFound, TrackTooShort, UnknownName
from robojackson.geometry.shortest_path import viterbi
from robojackson.motion.landmark_track import LandmarkTrack

LANDMARK_NAMES: tuple[str, ...] = (
    "nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye",
    "right_eye_outer", "left_ear", "right_ear", "mouth_left", "mouth_right", "left_shoulder",
    "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_pinky",
    "right_pinky", "left_index", "right_index", "left_thumb", "right_thumb", "left_hip",
    "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle", "left_heel", "right_heel",
    "left_foot_index", "right_foot_index",
)  # fmt: skip
MIN_FRAMES = 2
PERSON_M = 1.7
"""Diagonal of the box around a person's body landmarks, metres; for the scale of the image."""
HIPS_BELOW = 0.06
"""Distance of its hips below the hip joints, share of the trunk: 2-4 cm in the images of two
bodies, of which one is real, under eight cameras."""
SWAP_PRIOR_M = 0.003
"""Cost of a thirtieth of a second with exchanged sides, metres of mean displacement; on person_cam2
(60 frames a second) the same as twice of it, on which it was tuned."""
PRIOR_FPS = 30.0
FACING_FACTOR = 2.0
"""How much more it costs to exchange the sides of a person who was detected facing the camera."""
SWAP_FPS = 15.0
"""At lower frame rates a turn looks like an exchange (10 of 26 frames of a dancer at 8 Hz): there
an exchange also needs shoulders and hips that face the other way from one frame to the next."""
FEWEST_FPS = 9.0
"""Frame rate below which an exchange cannot be distinguished from a turn: at 6 to 8.5 up to half of
the frames of a dancer whose sides are right are exchanged, at 9 and 10 none."""
FACING_PRIOR = 0.03
"""Cost of a frame with exchanged sides at low frame rates, half turns."""


def landmark(name: str) -> int:
    """Return the index of a landmark; an unknown name raises `UnknownName` with the known ones."""
    if name not in LANDMARK_NAMES:
        raise UnknownName("landmark", name, "mocap.landmarks.blazepose", LANDMARK_NAMES)
    return LANDMARK_NAMES.index(name)


def mirror_of(name: str) -> str:
    """Return the same landmark on the other side; the nose is its own counterpart."""
    swap = {"left": "right", "right": "left"}
    return "_".join(swap.get(part, part) for part in name.split("_"))


MIRROR = np.array([landmark(mirror_of(name)) for name in LANDMARK_NAMES])
BODY = np.array(
    [
        landmark(f"{side}_{name}")
        for name in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
        for side in ("left", "right")
    ]
)
"""The twelve landmarks of trunk and limbs, left before right."""
HIPS = [landmark("left_hip"), landmark("right_hip")]
SHOULDERS = [landmark("left_shoulder"), landmark("right_shoulder")]
NOSE, EARS = landmark("nose"), [landmark("left_ear"), landmark("right_ear")]
NECK_DOWN = np.arange(landmark("left_shoulder"), len(LANDMARK_NAMES))
FACE = np.arange(landmark("left_shoulder"))


@dataclass(frozen=True)
class Landmarks:
    """A track without gaps.

    Attributes:
        image: Pixels of the upright image.
        local: Metres, axes of the camera (x right, y down, z away), origin between the hips.
        visibility: Visibility, 0..1; zero where interpolated.
        valid: Whether the frame was detected.
        swapped: Number of frames in which left and right were corrected.
    """

    image: Float[np.ndarray, "T 33 2"]
    local: Float[np.ndarray, "T 33 3"]
    visibility: Float[np.ndarray, "T 33"]
    valid: np.ndarray
    swapped: int = 0


def repair(track: LandmarkTrack) -> Landmarks:
    """Fill gaps and correct swapped sides.

    Raises:
        TrackTooShort: fewer than two frames.
        NoPersonFound: fewer than two frames with a person.
    """
    found = track.detected
    if len(track) < MIN_FRAMES:
        raise TrackTooShort(
            f"motion needs at least {MIN_FRAMES} frames, this clip has {len(track)}"
        )
    if found.sum() < MIN_FRAMES:
        missed = len(track) - int(found.sum())
        raise NoPersonFound(f"no person found in {missed} of {len(track)} frames")
    seen = track_landmarks(track)
    return raise_hips(unswap(seen, track.fps))


def track_landmarks(track: LandmarkTrack) -> Landmarks:
    """Return the landmarks of a track with its gaps filled, sides as detected.

    If the camera moved, all are in the image of the first frame.
    """
    found = track.detected
    image = track.landmarks[..., :2] * np.array([track.width, track.height], float)
    if track.to_first is not None:
        image = warp(image, track.to_first)
    return Landmarks(
        image=fill_gaps(image, found),
        local=fill_gaps(track.world_landmarks, found),
        visibility=np.where(found[:, None], np.nan_to_num(track.visibility), 0.0),
        valid=found,
    )


def raise_hips(landmarks: Landmarks) -> Landmarks:
    """Move the hips along the trunk to the hip joints."""

    def raised(points: np.ndarray) -> np.ndarray:
        moved = np.array(points)
        trunk = points[:, SHOULDERS].mean(1) - points[:, HIPS].mean(1)
        moved[:, HIPS] += HIPS_BELOW * trunk[:, None]
        return moved

    return replace(landmarks, image=raised(landmarks.image), local=raised(landmarks.local))


def fill_gaps(values: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Interpolate gaps linearly in time; use the nearest found frame before the first and after the
    last."""
    time = np.arange(len(values))
    flat = values.reshape(len(values), -1)
    filled = [np.interp(time, time[found], column[found]) for column in flat.T]
    return np.stack(filled, -1).reshape(values.shape)


def unswap(landmarks: Landmarks, fps: float) -> Landmarks:
    """Exchange left and right of the body in the frames where that makes the track continuous."""
    swap = swapped_frames(landmarks, fps)
    if not swap.any():
        return landmarks
    return replace(
        landmarks,
        image=np.where(swap[:, None, None], landmarks.image[:, MIRROR], landmarks.image),
        local=exchanged(landmarks.local, swap),
        visibility=np.where(swap[:, None], landmarks.visibility[:, MIRROR], landmarks.visibility),
        swapped=int(swap.sum()),
    )


def exchanged(
    local: Float[np.ndarray, "T 33 3"], swap: Bool[np.ndarray, " T"]
) -> Float[np.ndarray, "T 33 3"]:
    """Return local landmarks with left and right exchanged in some frames, and the face turned.

    Who is taken for a person seen from the other side has the face on that side. The image says
    nothing of it: the face with its depth reversed about the ears looks the same (Necker, 1832).
    It is reversed where it looks to the back of the trunk.
    """
    sides = np.array(local[:, MIRROR])
    turned = 2.0 * sides[:, EARS, 2].mean(1, keepdims=True) - sides[:, FACE, 2]
    backward = _trunk_depth(sides) * (sides[:, NOSE, 2] - sides[:, EARS, 2].mean(1)) < 0.0
    sides[:, FACE, 2] = np.where(backward[:, None], turned, sides[:, FACE, 2])
    return np.where(swap[:, None, None], sides, local)


def _trunk_depth(local: Float[np.ndarray, "T 33 3"]) -> Float[np.ndarray, " T"]:
    """Return the share of the trunk's forward direction that points away from the camera."""
    across = sum(local[:, left] - local[:, right] for left, right in (SHOULDERS, HIPS))
    up = local[:, SHOULDERS].mean(1) - local[:, HIPS].mean(1)
    return np.asarray(unit(np.cross(across, up))[:, 2])


def swapped_frames(landmarks: Landmarks, fps: float) -> np.ndarray:
    """Return the most probable frames with left and right exchanged, by dynamic programming.

    Each frame is kept or exchanged; a step costs the mean displacement of the body's landmarks
    (image at the person's scale and depth, metres) or, where frames are far apart, the turn of
    shoulders and hips. Time with exchanged sides costs a little more, and most where the frames are
    near and the face was detected towards the camera: sides are exchanged in views from behind.
    """
    if fps < FEWEST_FPS:
        return np.zeros(len(landmarks.image), bool)
    same, other = _steps(landmarks) if fps >= SWAP_FPS else _turns(landmarks)
    prior = SWAP_PRIOR_M * PRIOR_FPS / fps if fps >= SWAP_FPS else FACING_PRIOR
    changes = np.stack([same, other, other, same], -1).reshape(-1, 2, 2)
    crossing = np.tile([0.0, prior], (len(landmarks.image), 1))
    if fps >= SWAP_FPS:
        crossing[_faces_camera(landmarks), 1] *= FACING_FACTOR
    return viterbi(crossing, changes).astype(bool)


def _faces_camera(landmarks: Landmarks) -> Bool[np.ndarray, " T"]:
    """Return the frames in which the nose is nearer to the camera than the ears."""
    depth = landmarks.local[..., 2]
    return np.asarray(depth[:, NOSE] < depth[:, EARS].mean(1))


def _steps(landmarks: Landmarks) -> tuple[np.ndarray, np.ndarray]:
    """Return the displacement between frames with both as detected, and with one exchanged."""
    span = np.linalg.norm(np.ptp(landmarks.image[:, BODY], axis=1), axis=-1).mean()
    metres = landmarks.image * (PERSON_M / max(span, 1.0))
    features = np.concatenate([metres, landmarks.local[..., 2:]], -1)
    kept, crossed = features[:, NECK_DOWN], features[:, MIRROR][:, NECK_DOWN]
    same = np.linalg.norm(kept[1:] - kept[:-1], axis=-1).mean(-1)
    other = np.linalg.norm(crossed[1:] - kept[:-1], axis=-1).mean(-1)
    return same, other


def _turns(landmarks: Landmarks) -> tuple[np.ndarray, np.ndarray]:
    """Return the turn of the line from right to left, half turns, as detected and with one
    exchanged."""
    pairs = [
        landmarks.local[:, one] - landmarks.local[:, other] for one, other in (HIPS, SHOULDERS)
    ]
    line = unit(np.sum(pairs, axis=0))
    cosine = np.clip(np.sum(line[1:] * line[:-1], -1), -1.0, 1.0)
    turn = np.arccos(cosine) / np.pi
    return turn, 1.0 - turn
