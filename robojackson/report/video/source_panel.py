"""The source clip around the person: plain, with the detector's landmarks, or with the skeleton.

Pixels, origin top left. The recovered skeleton is projected by the camera of the motion; where that
moved, by the camera of the first frame and the movement of the background since.
"""

from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from robojackson.body.skeleton import KEYPOINT_NAMES, PARENTS
from robojackson.mocap.landmarks.blazepose import landmark
from robojackson.mocap.reprojection import skeleton_in_image
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video import canvas
from robojackson.report.video.clip_pictures import ClipPictures

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


class SourceClip:
    """Pictures of a clip, cut around the person, for some of its frames, fastest in their order.

    Args:
        source, track: The clip and its landmarks.
        sequence: The motion recovered from them, or None.
        frames: Frames of the motion that will be shown.
        width, height: Size of a panel, pixels.
    """

    def __init__(
        self,
        source: Path,
        track: LandmarkTrack,
        sequence: SmplSequence | None,
        frames: Int[np.ndarray, " N"],
        width: int,
        height: int,
    ) -> None:
        self._track, self._size = track, (width, height)
        self._found = track.landmarks[..., :2] * [track.width, track.height]
        self._body = None if sequence is None else skeleton_in_image(sequence, track)
        seen = [self._found, *([] if self._body is None else [self._body])]
        around = np.concatenate([points.reshape(-1, 2) for points in seen])
        strip = canvas.strip_height(width, height)
        box = canvas.crop_box(around, (track.width, track.height), width / (height - strip))
        over = round(box[3] * strip / (height - strip))
        self._box = box[0], box[1] - over, box[2], box[3] + over
        self._row = {int(frame): track.nearest(frame / track.fps) for frame in frames}
        cut = partial(canvas.cut, box=self._box, size=self._size)
        self._pictures = ClipPictures(source, self._row.values(), cut)

    def plain(self, frame: int) -> canvas.Picture:
        """Return the picture nearest to the time of a frame; backdrop where the clip has none."""
        picture = self._pictures.at(self._row[frame])
        return self._backdrop() if picture is None else picture.copy()

    def with_landmarks(self, frame: int) -> canvas.Picture:
        """Return the picture with the detector's landmarks."""
        row = self._row[frame]
        picture = self._pictures.at(row)
        if picture is None:
            return self._backdrop()
        panel = picture.copy()
        _draw_person(panel, self._inside(self._found[row]), self._track.visibility[row])
        return panel

    def with_skeleton(self, frame: int) -> canvas.Picture:
        """Return the picture with the recovered skeleton; with landmarks if its camera is
        unknown."""
        if self._body is None:
            return self.with_landmarks(frame)
        picture = self._pictures.at(self._row[frame])
        if picture is None:
            return self._backdrop()
        panel = picture.copy()
        points = self._inside(self._body[min(frame, len(self._body) - 1)])
        draw_skeleton(panel, points, max(2, panel.shape[1] // 130))
        return panel

    def _backdrop(self) -> canvas.Picture:
        return np.full((self._size[1], self._size[0], 3), canvas.BACKDROP, np.uint8)

    def _inside(self, pixels: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 2"]:
        result: np.ndarray = (pixels - self._box[:2]) * (self._size[0] / self._box[2])
        return result


def draw_skeleton(panel: canvas.Picture, points: Float[np.ndarray, "29 2"], width: int) -> None:
    """Draw bones and joints of a projected skeleton, in place, each side in its colour."""
    for child, parent in enumerate(PARENTS):
        if parent >= 0:
            canvas.draw_line(panel, points[parent], points[child], (14, 16, 21), width + 2)
    for child, parent in enumerate(PARENTS):
        if parent >= 0:
            colour = canvas.side_colour(KEYPOINT_NAMES[child])
            canvas.draw_line(panel, points[parent], points[child], colour, width)
            canvas.draw_dot(panel, points[child], colour, width // 2 + 1)


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
