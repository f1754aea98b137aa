"""Two dancers in one room who change places, one passing in front of the other, with the truth.

Cut out of two bundled clips by the difference from their empty room. Both wear the same clothes, so
only their motion and size tell them apart. Every run makes the same pictures.
"""

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import cv2
import numpy as np

from robojackson.clips.video import read_frames
from tools.difficult_clips import write

CLIPS = Path(__file__).parent.parent / "clips"
BEHIND, IN_FRONT = "dance_b", "dance_a"
APART_PX = 150
NEARER = 1.3
"""How much larger the one in front is."""
LEVEL = 22
"""Difference from the empty room that is a person, 0..255."""
SIZE = 640, 480


def crossing(frames: int = 77) -> tuple[list[np.ndarray], np.ndarray]:
    """Pictures, and where the middle of the hips of either is: (T, 2, 2) pixels, behind, front."""
    cut = {name: list(islice(cut_out(name), frames)) for name in (BEHIND, IN_FRONT)}
    where = {name: hips(name) for name in cut}
    room = empty_room(IN_FRONT)
    pictures, places = [], []
    for index in range(frames):
        way = APART_PX * (1.0 - 2.0 * index / (frames - 1))
        picture, row = room.copy(), []
        for name, shift, scale in ((BEHIND, way, 1.0), (IN_FRONT, -way, NEARER)):
            image, mask = cut[name][index]
            turn = np.float32(
                [
                    [scale, 0, shift + SIZE[0] / 2 * (1 - scale)],
                    [0, scale, SIZE[1] / 2 * (1 - scale)],
                ]
            )
            there = cv2.warpAffine(mask, turn, SIZE) > 0
            picture[there] = cv2.warpAffine(image, turn, SIZE)[there]
            row.append(turn @ [*where[name][index], 1.0])
        pictures.append(picture)
        places.append(row)
    return pictures, np.array(places)


def empty_room(name: str) -> np.ndarray:
    """The room of a clip without the dancer, who leaves every place for half of the time."""
    return np.median(np.array(list(read_frames(CLIPS / f"{name}.mp4"))[::2]), 0).astype(np.uint8)


def cut_out(name: str) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Frames of a clip and the pixels of the dancer, 0 or 1."""
    room = empty_room(name)
    for image in read_frames(CLIPS / f"{name}.mp4"):
        mask = (cv2.absdiff(image, room).max(-1) > LEVEL).astype(np.uint8)
        mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((7, 7), np.uint8))
        mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        count, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
        largest = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax()) if count > 1 else 1
        yield image, (labels == largest).astype(np.uint8)


def hips(name: str) -> np.ndarray:
    """Middle of the hips of a bundled dancer, pixels."""
    with np.load(CLIPS / f"{name}_gt.npz") as truth:
        names, joints = truth["names"].tolist(), truth["joints"].astype(float)
        camera = truth["proj"] @ truth["view"]
    middle = joints[:, [names.index("L_Hip"), names.index("R_Hip")]].mean(1)
    clip = np.concatenate([middle, np.ones((len(middle), 1))], -1) @ camera.T
    return np.asarray((clip[:, :2] / clip[:, 3:] * [0.5, -0.5] + 0.5) * SIZE)


def write_crossing(path: Path, frames: int = 77) -> np.ndarray:
    """The clip as a file; returns where the hips are."""
    pictures, places = crossing(frames)
    write(path, pictures)
    return places
