"""What the pose detector saw: one row a frame, NaN where nobody was found."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

LANDMARKS = 33


@dataclass(frozen=True)
class LandmarkTrack:
    """BlazePose landmarks of one person through a clip.

    Attributes:
        fps: Frames a second of the clip.
        width, height: Size of the upright image, pixels.
        landmarks: Image coordinates divided by width and height, z in the scale of x.
        world_landmarks: Metres, origin between the hips, x right, y down, z away from the camera.
        visibility: 0..1 a landmark.
    """

    fps: float
    width: int
    height: int
    landmarks: Float[np.ndarray, "T 33 3"]
    world_landmarks: Float[np.ndarray, "T 33 3"]
    visibility: Float[np.ndarray, "T 33"]

    def __len__(self) -> int:
        return len(self.landmarks)

    @property
    def detected(self) -> np.ndarray:
        """True in frames where a person was found, shape (T,)."""
        return ~np.isnan(self.landmarks[:, 0, 0])
