"""Made-up people: landmarks of somebody who stands, at a place and of a size."""

import numpy as np

from robojackson.clips.crowd import Sighting

SIZE = 640, 480
UPRIGHT = np.zeros((33, 2))
for numbers, (x, y) in {
    (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10): (0.0, -0.45),
    (11, 13, 15, 17, 19, 21): (0.1, -0.3),
    (12, 14, 16, 18, 20, 22): (-0.1, -0.3),
    (23,): (0.06, 0.0),
    (24,): (-0.06, 0.0),
    (25,): (0.06, 0.25),
    (26,): (-0.06, 0.25),
    (27, 29, 31): (0.06, 0.5),
    (28, 30, 32): (-0.06, 0.5),
}.items():
    UPRIGHT[list(numbers)] = x, y
"""Body heights, the middle of the hips at the origin, the subject's left at the right: a front."""
RED, BLUE = np.array([130.0, 200, 180, 40, 130, 60]), np.array([60.0, 140, 40, 200, 110, 190])


def row_of(x: float, y: float = 240.0, tall: float = 200.0, sure: float = 0.9) -> np.ndarray:
    """Landmarks (33, 7) of somebody whose hips are at a pixel."""
    row = np.zeros((33, 7))
    row[:, :2] = (UPRIGHT * tall + [x, y]) / SIZE
    row[:, 6] = sure
    return row


def seen(x: float, y: float = 240.0, tall: float = 200.0, looks: np.ndarray = RED) -> Sighting:
    """A sighting of such a person."""
    return Sighting(row_of(x, y, tall), looks)


def hips_x(rows: np.ndarray) -> np.ndarray:
    """Where the hips of a track are, pixels; NaN where nobody was seen."""
    return rows[:, [23, 24], 0].mean(1) * SIZE[0]
