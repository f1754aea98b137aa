"""The motion of two cameras: synchronise the clips, calibrate the cameras, triangulate the
landmarks. Where one of them has no person, the other one is used alone.

Neither camera may move. The result is in the frames of the first clip. Metres, seconds.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from robojackson.errors import ViewsDisagree
from robojackson.mocap.landmarks.blazepose import BODY, HIPS
from robojackson.mocap.recover import MocapConfig, View, finish_motion, view_track
from robojackson.mocap.reprojection import leaving_out_weak
from robojackson.mocap.temporal.features import resample
from robojackson.mocap.views.relative_camera import (
    RAY_SD,
    DepthPrior,
    RelativeCamera,
    calibrate,
    sampson,
    triangulate,
)
from robojackson.mocap.views.timing import Offset, find_offsets, rates
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence

LARGEST_MISS_M = 0.0185
"""Largest median distance between rays to the same joint: above it the clips differ. Nine pairs of
clips of the same dance miss by 8 to 18 mm; of 26 pairs of different ones two with a walk by 15,
the others by 19.5 to 95."""
LEAST_FRAMES = 10
"""Least number of frames in which both cameras see the person."""
SEEN_BY_BOTH = 0.3
"""Least visibility in both images of a joint that counts as triangulated."""
DEPTH_SD_M, TRIANGULATED_SD_M = 0.1, 0.03
"""Spreads of one camera's depth relative to the hips, and of a triangulated one."""
FAINTEST = 0.1
ROUNDS = 3


@dataclass(frozen=True)
class _Pair:
    """The same moments before both cameras.

    Attributes:
        points: Landmarks before each camera, metres.
        visibility: 0..1, zero where a camera has no frame.
        valid: Whether a person was detected in either camera.
    """

    points: tuple[np.ndarray, np.ndarray]
    visibility: tuple[np.ndarray, np.ndarray]
    valid: np.ndarray

    @property
    def rays(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the image points at depth one."""
        one, two = (p[..., :2] / p[..., 2:] for p in self.points)
        return one, two

    @property
    def both(self) -> np.ndarray:
        """Return the visibility of each landmark in the worse camera."""
        return np.asarray(np.minimum(*self.visibility))


def recover_together(
    first: LandmarkTrack, second: LandmarkTrack, config: MocapConfig, heard_s: float | None = None
) -> SmplSequence:
    """Recover the motion of a person that two cameras film, in the frames of the first.

    Args:
        first, second: The same person in both clips.
        config: Settings of the recovery.
        heard_s: Start of the second clip in the first, from the sound; None uses the motion.
    Raises:
        TrackTooShort, NoPersonFound: no motion can be recovered.
        ViewsDisagree: the clips do not show the same motion, or a camera moved.
    """
    if first.to_first is not None or second.to_first is not None:
        raise ViewsDisagree("a camera moved: two cameras that are calibrated by the dancer stand")

    def recovered(given: LandmarkTrack) -> SmplSequence:
        return _recovered(given, second, config, heard_s)

    return leaving_out_weak(recovered, first, config.leave_out_weak)


def _recovered(
    first: LandmarkTrack, second: LandmarkTrack, config: MocapConfig, heard_s: float | None
) -> SmplSequence:
    views = view_track(first, config), view_track(second, config)
    offsets = [heard_s] if heard_s is not None else [o.seconds for o in _by_motion(*views)]
    found = [made for began in offsets if (made := _calibrated(*views, began))]
    if not found or (best := min(found, key=lambda made: made.miss_m)).miss_m > LARGEST_MISS_M:
        raise ViewsDisagree(_why(found))
    camera, pair = best.camera, best.pair
    both = pair.both[:, BODY] > SEEN_BY_BOTH
    alone = DEPTH_SD_M if views[0].depth_m is None else views[0].depth_m
    pinhole = views[0].pinhole
    view = replace(
        views[0],
        points=_fused(camera, pair),
        depth_m=np.where(both, TRIANGULATED_SD_M, alone),
        landmarks=replace(
            views[0].landmarks, visibility=np.maximum(*pair.visibility), valid=pair.valid
        ),
        pinhole=replace(pinhole, focal_px=pinhole.focal_px * camera.focal[0]),
        ground=None,  # without a scene, balance of triangulated points: 2.8 degrees, network 4.0
    )
    note = (
        f"two cameras, {np.linalg.norm(camera.shift):.1f} m apart: the second clip begins at "
        f"{best.began_s:.3f} s; their rays miss each other by {1e3 * best.miss_m:.0f} mm (median)"
    )
    sequence = finish_motion(view, config)
    return replace(sequence, notes=(*sequence.notes, note))


@dataclass(frozen=True)
class _Calibrated:
    """A camera, the moments it was fitted to, and the median distance of the rays, metres."""

    camera: RelativeCamera
    pair: _Pair
    began_s: float
    miss_m: float


def _by_motion(one: View, two: View) -> list[Offset]:
    courses = (rates(v.landmarks.local, np.arange(len(v.points)) / v.track.fps) for v in (one, two))
    return find_offsets(*courses)


def _calibrated(one: View, two: View, began_s: float) -> _Calibrated | None:
    """Fit the second camera if its clip began then; None where too few frames are common."""
    pair = _together(one, two, began_s)
    seen = (pair.both[:, BODY] > 0.0).any(1)
    if seen.sum() < LEAST_FRAMES:
        return None
    bodies = [points[seen][:, BODY] for points in pair.points]
    trust, frames = pair.both[seen][:, BODY], np.flatnonzero(seen)
    camera = calibrate(bodies[0], bodies[1], trust, frames, one.track.fps)
    began_s -= camera.late_s
    pair = _together(one, two, began_s)
    off = np.abs(sampson(camera, *(r / f for r, f in zip(pair.rays, camera.focal, strict=True))))
    off = (off * pair.points[0][..., 2] * camera.focal[0])[:, BODY]
    both = pair.both[:, BODY] > SEEN_BY_BOTH
    miss_m = float(np.median(off[both])) if both.any() else np.inf
    return _Calibrated(camera, pair, began_s, miss_m)


def _why(found: list[_Calibrated]) -> str:
    if not found:
        return f"the two clips have less than {LEAST_FRAMES} frames of one person in common"
    least = min(made.miss_m for made in found)
    return (
        "the two clips do not seem to show the same dance: the rays to the joints miss each other "
        f"by {1e3 * least:.0f} mm at best, {1e3 * LARGEST_MISS_M:.0f} are allowed; give one clip "
        "alone, or two that run at the same time"
    )


def _together(one: View, two: View, began: float) -> _Pair:
    """Return both cameras' landmarks at the moments of the first one's frames."""
    times = np.arange(len(one.points)) / one.track.fps
    places = (times - began) * two.track.fps
    inside = (places >= 0.0) & (places <= len(two.points) - 1)
    visibility = resample(two.landmarks.visibility, places) * inside[:, None]
    detected = inside & (resample(two.landmarks.valid.astype(float), places) > 1.0 - 1e-9)
    return _Pair(
        (one.in_image(), resample(two.in_image(), places)),
        (one.landmarks.visibility, visibility),
        one.landmarks.valid | detected,
    )


def _fused(camera: RelativeCamera, pair: _Pair) -> Float[np.ndarray, "T 33 3"]:
    """Return landmarks in the first camera's frame: where the rays meet, with the cameras' own
    depths relative to the hips."""
    one, two = (ray / f for ray, f in zip(pair.rays, camera.focal, strict=True))
    sure = tuple(np.clip(v, FAINTEST, 1.0) * (v > 0.0) for v in pair.visibility)
    alone = np.concatenate([one, np.ones((*one.shape[:-1], 1))], -1)
    alone = alone * pair.points[0][..., 2:] * camera.focal[0]
    met = np.all(pair.both > 0.0, axis=1)[:, None, None]
    points = np.where(met, triangulate(camera, (one, two), (sure[0], sure[1])), alone)
    for _ in range(ROUNDS):
        roots = [p[:, HIPS].mean(1)[:, None, 2] for p in (points, camera.to_second(points))]
        depths, weight, tight = [], [], []
        for root, own, known in zip(roots, pair.points, sure, strict=True):
            depths.append(root + own[..., 2] - own[:, HIPS, 2].mean(1, keepdims=True))
            weight.append(np.sqrt(known) / (RAY_SD * root))
            tight.append(np.sqrt(np.maximum(known, 0.0)) / DEPTH_SD_M)
        tight[0] = np.maximum(tight[0], 1.0)
        prior = DepthPrior((depths[0], depths[1]), (tight[0], tight[1]))
        points = triangulate(camera, (one, two), (weight[0], weight[1]), prior)
    return points
