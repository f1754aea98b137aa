"""How far the recovered body lies off the picture: at the person's distance, metres."""

import numpy as np
from jaxtyping import Float

from robojackson.body.skeleton import keypoint
from robojackson.mocap.landmarks.blazepose import BODY, LANDMARK_NAMES
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video.source_panel import skeleton_in_image

OFF_M = 0.12
"""Mean distance from which on a stretch counts as badly recovered: the width of a head."""
SEEN = 0.5
KEYPOINTS = [keypoint(LANDMARK_NAMES[index]) for index in BODY]


def reprojection_error(
    sequence: SmplSequence, track: LandmarkTrack
) -> Float[np.ndarray, " T"] | None:
    """Return the mean distance of the twelve joints from the landmarks in each frame of a motion.

    Only landmarks that are seen count; NaN where none is. None where the camera is not known.
    """
    drawn = skeleton_in_image(sequence, track)
    if drawn is None:
        return None
    rows = [track.nearest(frame / sequence.fps) for frame in range(len(sequence))]
    detected = track.landmarks[rows][:, BODY, :2] * [track.width, track.height]
    seen = np.nan_to_num(track.visibility[rows][:, BODY]) > SEEN
    apart = np.linalg.norm(drawn[:, KEYPOINTS] - detected, axis=-1)
    camera = sequence.camera
    place = np.asarray(sequence.keypoints_w, float)[:, 0] - np.array(camera["position_w"], float)
    depth = place @ np.array(camera["rotation_w"], float)[..., 2]
    metres = apart * (depth / np.array(camera["focal_px"], float))[:, None]
    counted = seen & np.isfinite(metres)
    total = np.where(counted, metres, 0.0).sum(1)
    return np.where(counted.any(1), total / np.maximum(counted.sum(1), 1), np.nan)
