"""What the temporal network finds of the ground: the direction of up, and its spread.

A still camera has one direction of gravity: the network's answers, each in the axes of its own ray,
are turned into the camera's axes and averaged over the clip. Their errors are those of the clip,
not of the frame, so that the spread does not fall with its length.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from robojackson.body.forward_kinematics import apply, unit
from robojackson.mocap.temporal.features import ClipView
from robojackson.mocap.temporal.temporal_network import SD_PER_ERROR, Output


@dataclass(frozen=True)
class GroundEvidence:
    """Evidence of one clip.

    Attributes:
        up: Unit vector against gravity, camera axes.
        roll_sd, pitch_sd: Standard deviations of its angle in the image and out of it, radians.
    """

    up: Float[np.ndarray, "3"]
    roll_sd: float
    pitch_sd: float

    def information(self) -> Float[np.ndarray, "3 3"]:
        """Return the information matrix whose least eigenvector is this up."""
        roll = unit(np.cross(self.up, FORWARD))
        pitch = np.cross(self.up, roll)
        matrix = np.outer(roll, roll) / self.roll_sd**2 + np.outer(pitch, pitch) / self.pitch_sd**2
        return np.asarray(matrix)


FORWARD = np.array([0.0, 0.0, 1.0])


def ground_evidence(
    found: Output, sight: ClipView, places: Float[np.ndarray, " S"]
) -> GroundEvidence:
    """Return the evidence of a clip.

    Args:
        found: Output of the network at its own frames.
        sight: The clip at its own frames.
        places: Frames of the network as frames of the clip.
    """
    axes = sight.axes[np.round(places).astype(int)]
    up = unit(apply(axes, found.up).mean(0))
    roll, pitch = SD_PER_ERROR * np.exp(np.log(found.tilt).mean(0))
    return GroundEvidence(up, float(roll), float(pitch))
