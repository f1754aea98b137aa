"""The source clip around the person, with the landmarks that the detector found."""

from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from robojackson.clips.video import read_frames
from robojackson.mocap.landmarks.blazepose import landmark
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.report.video import canvas

BONES = (
    ("left_shoulder", "right_shoulder"), ("left_hip", "right_hip"),
    ("left_shoulder", "left_hip"), ("right_shoulder", "right_hip"),
    ("left_shoulder", "left_elbow"), ("left_elbow", "left_wrist"), ("left_wrist", "left_index"),
    ("right_shoulder", "right_elbow"), ("right_elbow", "right_wrist"),
    ("right_wrist", "right_index"),
    ("left_hip", "left_knee"), ("left_knee", "left_ankle"), ("left_ankle", "left_heel"),
    ("left_heel", "left_foot_index"),
    ("right_hip", "right_knee"), ("right_knee", "right_ankle"), ("right_ankle", "right_heel"),
    ("right_heel", "right_foot_index"), ("nose", "left_ear"), ("nose", "right_ear"),
)  # fmt: skip
_FAINT = 0.5
"""A bone is left out when one of its ends is less visible than this."""


def source_panels(
    source: Path, track: LandmarkTrack, frames: Int[np.ndarray, " N"], width: int, height: int
) -> dict[int, canvas.Picture]:
    """The panel of every frame that is named, by frame: of the picture nearest to its time."""
    pixels = track.landmarks[..., :2] * [track.width, track.height]
    box = canvas.crop_box(pixels.reshape(-1, 2), (track.width, track.height), width / height)
    shown = {int(frame): track.nearest(frame / track.fps) for frame in frames}
    wanted, last = set(shown.values()), max(shown.values())
    panels: dict[int, canvas.Picture] = {}
    for index, image in enumerate(read_frames(source)):
        if index in wanted:
            panel = canvas.cut(image, box, (width, height))
            _draw_person(panel, _inside(pixels[index], box, width), track.visibility[index])
            panels[index] = panel
        if index >= last:
            break
    return {frame: panels[index] for frame, index in shown.items() if index in panels}


def _inside(
    pixels: Float[np.ndarray, "33 2"], box: tuple[int, int, int, int], width: int
) -> Float[np.ndarray, "33 2"]:
    result: np.ndarray = (pixels - box[:2]) * (width / box[2])
    return result


def _draw_person(
    panel: canvas.Picture, points: Float[np.ndarray, "33 2"], visibility: Float[np.ndarray, " 33"]
) -> None:
    thickness = max(1, panel.shape[1] // 160)
    for start, end in BONES:
        a, b = landmark(start), landmark(end)
        if min(visibility[a], visibility[b]) >= _FAINT:
            colour = canvas.side_colour(start if "left" in end or "right" in end else "")
            if ("left" in start) != ("left" in end):
                colour = canvas.MIDDLE
            canvas.draw_line(panel, points[a], points[b], colour, thickness)
            canvas.draw_dot(panel, points[b], colour, thickness + 1)
