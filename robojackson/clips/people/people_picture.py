"""A picture of all people in a clip with their numbers: the frame that shows most of them best."""

from pathlib import Path

import cv2
import numpy as np

from robojackson.clips.people.person_extent import box
from robojackson.clips.people.tracked_people import TrackedPeople
from robojackson.clips.video import timed_frames

COLOURS = ((230, 60, 60), (40, 120, 230), (40, 170, 80), (200, 120, 20), (150, 60, 200))
LONG_SIDE = 1280
MARGIN = 0.08


def draw_people(path: Path, cast: TrackedPeople) -> bytes:
    """Return the picture as PNG."""
    chosen = best_frame(cast)
    frames = timed_frames(path, short_side=LONG_SIDE)
    image = next(image for index, (_, image) in enumerate(frames) if index == chosen)
    factor = min(1.0, LONG_SIDE / max(image.shape[:2]))
    picture = cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    height, width = picture.shape[:2]
    for number, rows in enumerate(cast.rows, start=1):
        corners = box(rows[chosen, :, :2], MARGIN, width, height)
        if corners:
            _frame(picture, corners, number)
    return cv2.imencode(".png", picture[..., ::-1])[1].tobytes()


def best_frame(cast: TrackedPeople) -> int:
    """Return the frame with most people in it, and among those the one with the largest
    distances."""
    places = np.array([rows[:, 0, 0] for rows in cast.rows])
    count = (~np.isnan(places)).sum(0)
    apart = np.array([_nearest(column[~np.isnan(column)]) for column in places.T])
    return int(np.lexsort((apart, count))[-1])


def _nearest(places: np.ndarray) -> float:
    return float(np.diff(np.sort(places)).min()) if len(places) > 1 else 0.0


def _frame(picture: np.ndarray, corners: tuple[int, int, int, int], number: int) -> None:
    x0, y0, x1, y1 = corners
    colour = COLOURS[(number - 1) % len(COLOURS)]
    scale = max(picture.shape[0] / 480, 0.5)
    cv2.rectangle(picture, (x0, y0), (x1, y1), colour, max(2, round(2 * scale)))
    at = (x0 + round(4 * scale), max(y0 - round(6 * scale), round(24 * scale)))
    cv2.putText(
        picture, str(number), at, cv2.FONT_HERSHEY_SIMPLEX, scale, colour, max(2, round(2 * scale)),
        cv2.LINE_AA,
    )  # fmt: skip
