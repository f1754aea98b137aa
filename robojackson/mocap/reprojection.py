"""The recovered body in the picture: where it is drawn, and how far it lies off the landmarks.

The body is projected by the camera of its motion; where that moved, by the camera of the first
frame and the movement of the background since. Pixels, origin top left; distances at the person's
distance, metres.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_dilation

from robojackson.body.feet import stretches
from robojackson.body.skeleton import keypoint
from robojackson.clips.people.camera_path import warp
from robojackson.errors import NoPersonFound, TrackTooShort, ViewsDisagree
from robojackson.mocap.landmarks.blazepose import BODY, LANDMARK_NAMES, MIRROR
from robojackson.motion.landmark_track import LandmarkTrack, evenly
from robojackson.motion.smpl_sequence import SmplSequence

CAMERA = {"focal_px", "width", "height", "rotation_w", "position_w"}
"""Camera metadata that a motion needs to be drawn over the source."""
OFF_M = 0.15
"""Mean distance above which a frame counts as badly recovered: the width of a head."""
LEFT_OUT = "left out: the body lay off the picture"
"""Words of the note on weak frames that were left out."""
SEEN = 0.5
BESIDE_S = 0.1
"""Time on each side of a weak stretch that is left out with it, seconds."""
KEYPOINTS = [keypoint(LANDMARK_NAMES[index]) for index in BODY]


def skeleton_in_image(
    sequence: SmplSequence, track: LandmarkTrack
) -> Float[np.ndarray, "T 29 2"] | None:
    """Return the recovered keypoints in pixels of every frame; None where the camera is unknown."""
    camera = sequence.camera
    if not set(camera) >= CAMERA:
        return None
    turn, place = np.array(camera["rotation_w"], float), np.array(camera["position_w"], float)
    local = (np.asarray(sequence.keypoints_w, float) - place) @ turn
    depth = np.where(local[..., 2:] > 0.0, local[..., 2:], np.nan)
    centre = np.array([camera["width"], camera["height"]], float) / 2.0
    pixels = local[..., :2] / depth * np.array(camera["focal_px"], float) + centre
    if track.to_first is None:
        return np.asarray(pixels)
    rows = [track.nearest(frame / sequence.fps) for frame in range(len(sequence))]
    return warp(pixels, np.linalg.inv(track.to_first[rows]))


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
    """Return the frames with a detected person whose body is far off the picture."""
    error = reprojection_error(sequence, track)
    return np.zeros(len(sequence), bool) if error is None else _off(error, sequence)


def _off(error: Float[np.ndarray, " T"], sequence: SmplSequence) -> Bool[np.ndarray, " T"]:
    """Return the frames with a detected person whose error is too large."""
    return np.asarray((np.nan_to_num(error) > OFF_M) & np.asarray(sequence.valid, bool))


def reprojection_record(
    sequence: SmplSequence, track: LandmarkTrack, begin_s: float = 0.0
) -> dict[str, object]:
    """Return the median and the largest error, metres; the weak stretches and those that are filled
    in, seconds; and whether weak ones were left out.

    Args:
        begin_s: Where the clip begins in the video that the user has, seconds.
    """
    error = reprojection_error(sequence, track)
    if error is None or np.isnan(error).all():
        return {}

    def moments(frames: np.ndarray) -> list[list[float]]:
        return [[begin_s + frame / sequence.fps for frame in part] for part in stretches(frames)]

    return {
        "reprojection": {
            "median_m": float(np.nanmedian(error)),
            "largest_m": float(np.nanmax(error)),
            "weak_s": moments(_off(error, sequence)),
            "filled_s": moments(~np.asarray(sequence.valid, bool)),
            "left_out": any(LEFT_OUT in note for note in sequence.notes),
        }
    }


def leaving_out_weak(
    recover: Callable[[LandmarkTrack], SmplSequence], track: LandmarkTrack, leave_out: bool
) -> SmplSequence:
    """Return the motion of a track; on request again without the frames that were weak, where
    enough others are left.

    Args:
        recover: Function that recovers the motion of a track.
        track: Landmarks of the person.
        leave_out: Whether weak frames are left out.
    """
    sequence = recover(track)
    if not leave_out:
        return sequence
    even = evenly(track)
    kept = without_weak_frames(even, weak_frames(sequence, even))
    with suppress(TrackTooShort, NoPersonFound, ViewsDisagree):  # too little would be left
        return sequence if kept is even else recover(kept)
    return sequence


def without_weak_frames(track: LandmarkTrack, weak: Bool[np.ndarray, " T"]) -> LandmarkTrack:
    """Return a track in which no person is detected in weak stretches and beside them.

    The motion of such frames is interpolated between the poses before and after. The track is
    unchanged where no frame would be left.
    """
    reach = round(BESIDE_S * track.fps)
    near = binary_dilation(weak, iterations=reach) if reach else weak
    out = near & track.detected
    left = int((track.detected & ~out).sum())
    if not out.any() or not left:
        return track
    note = f"{int(out.sum())} frames {LEFT_OUT}"
    return replace(
        track,
        landmarks=np.where(out[:, None, None], np.nan, track.landmarks),
        world_landmarks=np.where(out[:, None, None], np.nan, track.world_landmarks),
        visibility=np.where(out[:, None], np.nan, track.visibility),
        notes=(*track.notes, note),
    )
