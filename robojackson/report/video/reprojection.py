"""Distance of the recovered body from the picture: at the person's distance, metres."""

import numpy as np
from jaxtyping import Float

from robojackson.body.feet import stretches
from robojackson.body.skeleton import keypoint
from robojackson.mocap.landmarks.blazepose import BODY, LANDMARK_NAMES, MIRROR
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video.source_panel import skeleton_in_image

OFF_M = 0.15
"""Mean distance above which a frame counts as badly recovered: the width of a head."""
SEEN = 0.5
KEYPOINTS = [keypoint(LANDMARK_NAMES[index]) for index in BODY]


def reprojection_error(
    sequence: SmplSequence, track: LandmarkTrack
) -> Float[np.ndarray, " T"] | None:
    """Return the mean distance of the twelve joints from the landmarks in each frame of a motion.

    Only visible landmarks count; NaN where there is none. Sides count as detected or exchanged,
    whichever is nearer. None where the camera is unknown.
    """
    drawn = skeleton_in_image(sequence, track)
    if drawn is None:
        return None
    rows = [track.nearest(frame / sequence.fps) for frame in range(len(sequence))]
    camera = sequence.camera
    away = np.asarray(sequence.keypoints_w, float)[:, 0] - np.array(camera["position_w"], float)
    depth = away @ np.array(camera["rotation_w"], float)[..., 2]
    scale = depth / np.array(camera["focal_px"], float)
    found = []
    for order in (BODY, MIRROR[BODY]):
        detected = track.landmarks[rows][:, order, :2] * [track.width, track.height]
        seen = np.nan_to_num(track.visibility[rows][:, order]) > SEEN
        apart = np.linalg.norm(drawn[:, KEYPOINTS] - detected, axis=-1) * scale[:, None]
        seen &= np.isfinite(apart)
        total = np.where(seen, apart, 0.0).sum(1)
        found.append(np.where(seen.any(1), total / np.maximum(seen.sum(1), 1), np.nan))
    return np.asarray(np.fmin(found[0], found[1]))


def weak_frames(sequence: SmplSequence, track: LandmarkTrack) -> np.ndarray:
    """Return the frames without a detected person, or whose body is far off the picture."""
    error = reprojection_error(sequence, track)
    off = np.zeros(len(sequence), bool) if error is None else np.nan_to_num(error) > OFF_M
    return np.asarray(off | ~np.asarray(sequence.valid, bool))


def reprojection_record(sequence: SmplSequence, track: LandmarkTrack) -> dict[str, object]:
    """Return the median and the largest error, metres, and the weak stretches, seconds."""
    error = reprojection_error(sequence, track)
    if error is None or np.isnan(error).all():
        return {}
    weak = stretches(weak_frames(sequence, track))
    return {
        "reprojection": {
            "median_m": float(np.nanmedian(error)),
            "largest_m": float(np.nanmax(error)),
            "weak_s": [[start / sequence.fps, end / sequence.fps] for start, end in weak],
        }
    }
