"""Fuse two pose models: the mean of their landmarks.

Their errors are only partly the same, so that the mean is nearer to the truth than either. Each
track is first cleared of exchanged sides, else the mean of a left and a right leg would be between
them; and turned as a whole to the first one: "heavy" leans every person by 5 degrees where "full"
leans them by 1 (mean of the eight tuned clips).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from robojackson.body.forward_kinematics import swing
from robojackson.mocap.landmarks.blazepose import (
    MIRROR,
    SHOULDERS,
    exchanged,
    landmark,
    swapped_frames,
    track_landmarks,
)
from robojackson.motion.landmark_track import LandmarkTrack

ANKLES = [landmark("left_ankle"), landmark("right_ankle")]


def fuse_tracks(tracks: Sequence[LandmarkTrack]) -> LandmarkTrack:
    """Return one track of the same frames: the mean of those models that found the person.

    Args:
        tracks: Tracks of the same clip and frames, one a model.
    Raises:
        ValueError: the tracks are of different clips.
    """
    first = tracks[0]
    if any((len(t), t.width, t.height, t.fps) != _shape(first) for t in tracks):
        raise ValueError("tracks to fuse must be of the same clip")
    clean = [_unswapped(track) for track in tracks]
    return replace(
        first,
        landmarks=_mean([track.landmarks for track in clean]),
        world_landmarks=_mean([_turned(t.world_landmarks, clean[0]) for t in clean]),
        visibility=_mean([track.visibility for track in clean]),
    )


def _shape(track: LandmarkTrack) -> tuple[int, int, int, float]:
    return len(track), track.width, track.height, track.fps


def _unswapped(track: LandmarkTrack) -> LandmarkTrack:
    if track.detected.sum() < 2:
        return track
    swap = swapped_frames(track_landmarks(track), track.fps)
    pick = np.where(swap[:, None], MIRROR, np.arange(len(MIRROR)))
    frames = np.arange(len(track))[:, None]
    return replace(
        track,
        landmarks=track.landmarks[frames, pick],
        world_landmarks=exchanged(track.world_landmarks, swap),
        visibility=track.visibility[frames, pick],
    )


def _turned(world: np.ndarray, first: LandmarkTrack) -> np.ndarray:
    """Return world landmarks after the shortest rotation that gives them the mean lean of a
    track."""
    both = first.detected & ~np.isnan(world[:, 0, 0])
    if not both.any():
        return world
    return np.asarray(world @ swing(_lean(world[both]), _lean(first.world_landmarks[both])).T)


def _lean(world: np.ndarray) -> np.ndarray:
    """Return the direction from the ankles to the shoulders, mean over the clip."""
    return np.asarray((world[:, SHOULDERS] - world[:, ANKLES]).mean((0, 1)))


def _mean(values: Sequence[np.ndarray]) -> np.ndarray:
    """Return the mean over the tracks that have a frame; NaN where none has."""
    stacked = np.stack(values)
    known = ~np.isnan(stacked)
    total = np.where(known, stacked, 0.0).sum(0)
    return np.where(known.any(0), total / np.maximum(known.sum(0), 1), np.nan)
