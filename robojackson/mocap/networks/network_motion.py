"""The motion of a clip by the published networks, on the floor of our world.

BlazePose only gives the person's position; everything after the network is in `mocap.recover`.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from robojackson.body.smoothing import lowpass
from robojackson.clips.quality.visibility import weigh_visibility
from robojackson.mocap.landmarks.blazepose import fill_gaps, repair
from robojackson.mocap.landmarks.pinhole_camera import Pinhole
from robojackson.mocap.networks.inference import Estimate, Networks, Progress, estimate
from robojackson.mocap.networks.network_config import NetworkConfig
from robojackson.mocap.pose.known_twist import TurnedBody, pose_keypoints
from robojackson.mocap.recover import MocapConfig, focal_of, recover_points, scene_of
from robojackson.mocap.recovered_sequence import camera_facts
from robojackson.mocap.reprojection import leaving_out_weak
from robojackson.motion.landmark_track import LandmarkTrack, even_times, evenly
from robojackson.motion.smpl_sequence import SmplSequence


def network_motion(
    track: LandmarkTrack,
    images: Iterable[np.ndarray],
    networks: Networks,
    mocap: MocapConfig,
    config: NetworkConfig,
    progress: Progress | None = None,
) -> SmplSequence:
    """Return the motion of the person in a track.

    Args:
        track: Landmarks of the person.
        images: The frames of the track, RGB.
        networks: Networks loaded from the files of `config`.
        mocap: Settings of the lens and the floor.
        config: Settings of the networks.
        progress: Called with (frames done, frames in all).
    Raises:
        TrackTooShort, NoPersonFound: no motion can be recovered.
    """
    track = weigh_visibility(track)
    scene = scene_of(track, None, mocap)
    lens = Pinhole(focal_of(track, scene, mocap), track.width, track.height)
    in_frame = repair(replace(track, to_first=None))
    shown = (in_frame, track.to_first, lens, track.fps, mocap.depth_cutoff_hz)
    found = estimate(images, *shown, networks, config, progress)
    found = resampled(found, track)

    def recovered(given: LandmarkTrack) -> SmplSequence:
        even = evenly(given)
        valid = repair(even).valid
        steady = steadied(found, valid, even.fps, config.cutoff_hz)
        turned = poser(steady, mocap)
        sequence = recover_points(
            steady.keypoints, turned, valid, lens, even.fps, mocap, scene=scene
        )
        notes = (*found.notes, *even.notes, *sequence.notes)
        camera = camera_facts(sequence.camera, even)
        return replace(sequence, betas=found.betas, person=even.person, notes=notes, camera=camera)

    return leaving_out_weak(recovered, track, mocap.leave_out_weak)


def resampled(found: Estimate, track: LandmarkTrack) -> Estimate:
    """Return the estimate resampled at 1 / fps, as `motion.landmark_track.evenly` does with
    landmarks."""
    if track.time_s is None:
        return found
    when = even_times(track)

    def at(values: np.ndarray) -> np.ndarray:
        columns = values.reshape(len(values), -1).T
        rows = np.stack([np.interp(when, track.times, column) for column in columns], -1)
        return rows.reshape(len(when), *values.shape[1:])

    return replace(
        found,
        keypoints=at(found.keypoints),
        twist=at(found.twist),
        confidence=at(found.confidence),
    )


def poser(
    found: Estimate, mocap: MocapConfig
) -> Callable[[Float[np.ndarray, "T 29 3"]], TurnedBody]:
    """Return a function that solves keypoints in any frame with the network's twists."""

    def posed(points: np.ndarray) -> TurnedBody:
        return pose_keypoints(points, found.twist, found.confidence, found.rest, mocap.method)

    return posed


def steadied(found: Estimate, valid: np.ndarray, fps: float, cutoff_hz: float) -> Estimate:
    """Return the estimate with missing frames interpolated, all of them low-passed."""
    turns = found.twist / np.maximum(np.linalg.norm(found.twist, axis=-1, keepdims=True), 1e-9)
    return replace(
        found,
        keypoints=lowpass(fill_gaps(found.keypoints, valid), fps, cutoff_hz),
        twist=lowpass(fill_gaps(turns, valid), fps, cutoff_hz),
    )
