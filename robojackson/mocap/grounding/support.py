"""What carries a body in each frame: its feet, another part of it, or nothing.

Metres, seconds; floor and height at any level.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from robojackson.mocap.grounding import flight
from robojackson.mocap.grounding import floor as ground


class Support(NamedTuple):
    """What carries a body.

    Attributes:
        height: Height of the centre of mass.
        lowest: Height of the lowest point that may carry it (`floor.support_height`).
        falling: Frames of free fall, jumps among them.
        jumps: Frames of jumps, by their height (`flight.ballistic`).
        elsewhere: Frames in which other parts than the feet carry it.
    """

    height: Float[np.ndarray, " T"]
    lowest: Float[np.ndarray, " T"]
    falling: np.ndarray
    jumps: np.ndarray
    elsewhere: np.ndarray


def support_of(
    points: Float[np.ndarray, "T 29 3"], feet: Float[np.ndarray, "T 4 3"], fps: float
) -> Support:
    """Return what carries a body, from its keypoints and foot points."""
    height = ground.centre_of_mass(points)[:, 2]
    falling = flight.free_fall(height, fps)
    elsewhere = ground.off_feet(points, feet, falling, fps)
    lowest = ground.support_height(points, feet, elsewhere)
    jumps = flight.ballistic(height, lowest, fps)
    return Support(height, lowest, falling | jumps, jumps, elsewhere)
