"""Correct the detector's visibility: BlazePose reports .99 even for hidden landmarks.

It draws a whole body wherever it finds a part of one, and a face on the back of a head. So its
visibility is multiplied by what the picture allows: nothing outside the image is visible, no
face of a person who is turned away, and little in frames beside a gap.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_dilation

from robojackson.clips.people.person_extent import POINTS, indices
from robojackson.errors import NoPersonFound
from robojackson.motion.landmark_track import LandmarkTrack

EDGE = 0.03
"""Image heights beyond the edge at which a landmark counts nothing."""
GAP_FRAMES = 2
BESIDE_GAP = 0.7
"""Number of frames before and after a gap, and the factor of their visibility."""
FACE = slice(0, 11)
FROM_BEHIND, NO_FACE = 0.8, 0.2
"""Times the visibility of a body that is seen from behind, and of its face."""
BACK_WIDTH = 0.15
"""Trunk lengths between both shoulders, and hips, in the image of a person who is turned away."""
VISIBLE = 0.3
"""Weighed visibility of a landmark that was seen."""
TRUNK_SHARE = 0.3
"""Share of the frames with a person in which hips must be seen: a motion hangs on them."""
NOTED_SHARE = 0.1
PARTS = {
    "legs": ("left_knee", "right_knee", "left_ankle", "right_ankle"),
    "feet": ("left_ankle", "right_ankle"),
    "arms": ("left_elbow", "right_elbow", "left_wrist", "right_wrist"),
}
"""Parts that a note names when they are hidden in more of the frames than `NOTED_SHARE`."""


def weigh_visibility(track: LandmarkTrack) -> LandmarkTrack:
    """Return the track with the visibility that the picture allows, and notes of what was hidden.

    Raises:
        NoPersonFound: the hips are hardly ever visible, as in a clip of a face.
    """
    visibility = track.visibility * inside(track) * steady(track)[:, None]
    away = turned_away(track)
    visibility[away] *= FROM_BEHIND
    visibility[away, FACE] *= NO_FACE
    honest = replace(track, visibility=visibility)
    if not track.detected.any():
        return honest
    _require_trunk(honest)
    notes = (*track.notes, *unseen(honest))
    if (share := float(away[track.detected].mean())) > NOTED_SHARE:
        notes = (*notes, f"seen from behind in {share:.0%} of the frames: less certain")
    return replace(honest, notes=notes)


def inside(track: LandmarkTrack) -> Float[np.ndarray, "T 33"]:
    """Return 1 for landmarks inside the image, 0 for those further beyond its edge than `EDGE`."""
    scale = np.array([track.width, track.height]) / track.height
    xy = track.landmarks[..., :2]
    beyond = np.maximum(np.maximum(-xy, xy - 1.0), 0.0) * scale
    return np.asarray(np.clip(1.0 - np.linalg.norm(beyond, axis=-1) / EDGE, 0.0, 1.0))


def turned_away(track: LandmarkTrack) -> Bool[np.ndarray, " T"]:
    """Return frames in which left shoulder and left hip are both at the left in the image: a
    back."""
    points = track.landmarks[..., :2] * (track.width, track.height)
    across = [
        points[:, POINTS[f"left_{name}"], :] - points[:, POINTS[f"right_{name}"], :]
        for name in ("shoulder", "hip")
    ]
    up = points[:, indices(("left_shoulder", "right_shoulder"))].mean(1)
    up = up - points[:, indices(("left_hip", "right_hip"))].mean(1)
    length = np.linalg.norm(up, axis=-1) + 1e-9
    right = np.stack([-up[:, 1], up[:, 0]], -1) / length[:, None]
    widths = np.stack([(side * right).sum(-1) for side in across]) / length
    return np.asarray((widths < -BACK_WIDTH).all(0))


def steady(track: LandmarkTrack) -> Float[np.ndarray, " T"]:
    """Return 1, less in the frames beside a gap, where the detector is about to lose the person."""
    lost = ~track.detected
    near = binary_dilation(lost, iterations=GAP_FRAMES)
    return np.where(near, BESIDE_GAP, 1.0)


def unseen(track: LandmarkTrack) -> tuple[str, ...]:
    """Return the parts of the body that are not visible, and in how many of the frames with a
    person."""
    visibility = track.visibility[track.detected]
    unseen_share = {
        part: float((visibility[:, indices(names)] < VISIBLE).all(1).mean())
        for part, names in PARTS.items()
    }
    noted = {part: share for part, share in unseen_share.items() if share > NOTED_SHARE}
    if "legs" in noted:
        noted.pop("feet", None)
    return tuple(
        f"{part} not seen in {share:.0%} of the frames: invented" for part, share in noted.items()
    )


def _require_trunk(track: LandmarkTrack) -> None:
    visibility = track.visibility[track.detected]
    hips = visibility[:, indices(("left_hip", "right_hip"))].max(1) >= VISIBLE
    if hips.mean() >= TRUNK_SHARE:
        return
    elbows = visibility[:, indices(("left_elbow", "right_elbow"))].max(1) >= VISIBLE
    what = "the upper body is" if elbows.mean() >= TRUNK_SHARE else "the face is"
    raise NoPersonFound(
        f"only {what} seen: the hips are in the picture in {hips.mean():.0%} of the frames, "
        f"at least {TRUNK_SHARE:.0%} are needed; film the whole body"
    )
