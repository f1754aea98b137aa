"""What the pose detector saw: one row a frame, NaN where nobody was found."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

LANDMARKS = 33
EVEN = 0.25
"""Frames that are off their place on an even grid by no more than this are evenly spaced."""


@dataclass(frozen=True)
class LandmarkTrack:
    """BlazePose landmarks of one person through a clip.

    Attributes:
        fps: Frames a second of the clip, the mean where they are not evenly spaced.
        width, height: Size of the upright image, pixels.
        landmarks: Image coordinates divided by width and height, z in the scale of x.
        world_landmarks: Metres, origin between the hips, x right, y down, z away from the camera.
        visibility: 0..1 a landmark, as the detector says.
        time_s: Seconds since the first frame; None where frame t is at t / fps.
        person: Number of the person among those in the clip, the largest is 1; 0 who is alone.
        notes: What the user must know of how he was seen.
        to_first: Takes pixels of each frame to those of the first, for a camera that moved; None
            where it stood.
    """

    fps: float
    width: int
    height: int
    landmarks: Float[np.ndarray, "T 33 3"]
    world_landmarks: Float[np.ndarray, "T 33 3"]
    visibility: Float[np.ndarray, "T 33"]
    time_s: Float[np.ndarray, " T"] | None = None
    person: int = 0
    notes: tuple[str, ...] = ()
    to_first: Float[np.ndarray, "T 3 3"] | None = None

    def __len__(self) -> int:
        return len(self.landmarks)

    @property
    def detected(self) -> np.ndarray:
        """True in frames where a person was found, shape (T,)."""
        return ~np.isnan(self.landmarks[:, 0, 0])

    @property
    def times(self) -> Float[np.ndarray, " T"]:
        """When each frame was taken, seconds since the first."""
        return np.arange(len(self)) / self.fps if self.time_s is None else self.time_s

    def nearest(self, time_s: float) -> int:
        """The frame that was taken next to a time, seconds since the first."""
        return int(np.abs(self.times - time_s).argmin())


def uneven(time_s: Float[np.ndarray, " T"], fps: float) -> bool:
    """Whether frames lie off an even grid of that rate, as in a phone's variable frame rate."""
    grid = np.arange(len(time_s)) / fps
    return bool((np.abs(time_s - grid) * fps > EVEN).any())


def even_times(track: LandmarkTrack) -> Float[np.ndarray, " T"]:
    """Times at equal spaces of 1 / fps from the first frame to the last, seconds."""
    last = float(track.times[-1])
    return np.minimum(np.arange(round(last * track.fps) + 1) / track.fps, last)


def evenly(track: LandmarkTrack) -> LandmarkTrack:
    """The same motion at equal spaces of 1 / fps, as the stages after this one need it.

    Linear between two frames; a frame between which and its neighbour nobody was found has nobody.
    """
    if track.time_s is None:
        return track
    when = even_times(track)
    after = np.clip(np.searchsorted(track.time_s, when), 1, max(len(track) - 1, 1))
    before = after - 1
    span = np.maximum(track.time_s[after] - track.time_s[before], 1e-9)
    share = np.clip((when - track.time_s[before]) / span, 0.0, 1.0)

    def at(values: np.ndarray) -> np.ndarray:
        weight = share.reshape(-1, *[1] * (values.ndim - 1))
        mixed = (1.0 - weight) * values[before] + weight * values[after]
        return np.where(
            weight == 0.0, values[before], np.where(weight == 1.0, values[after], mixed)
        )

    return replace(
        track,
        landmarks=at(track.landmarks),
        world_landmarks=at(track.world_landmarks),
        visibility=at(track.visibility),
        time_s=None,
        to_first=None if track.to_first is None else at(track.to_first),
    )
