"""Stability of a landmark track: missing joints plus jitter (RoboJackson, Algorithm 1).

Landmarks are normalised image coordinates; scores are unitless and LOWER IS STEADIER.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.files.table_file import Columns, Facts, TableFile
from robojackson.files.table_types import F64, I32, Column, TableSchema
from robojackson.motion.landmark_track import LANDMARKS, LandmarkTrack

USUAL_FPS = 30.0
STABILITY_SCORE = TableSchema(
    "StabilityScore",
    "clip",
    (
        Column("frames", I32),
        Column("detected", I32),
        Column("missing_joints", I32),
        Column("jitter", F64, "image sizes"),
        Column("stability_score", F64, "1"),
        Column("missing_joints_per_frame", F64, "1"),
        Column("jitter_per_frame", F64, "image sizes"),
        Column("score_per_second", F64, "1/s"),
    ),
)


@config_dataclass
class StabilityConfig:
    """Configuration of the stability score.

    Attributes:
        visibility_threshold: A landmark below this visibility (0..1) counts as missing.
    """

    visibility_threshold: float = Field(default=0.5, ge=0, le=1)


@dataclass(frozen=True)
class Stability(TableFile):
    """The score of one clip.

    Attributes:
        frames: Frames in the clip.
        detected: Frames in which a person was found.
        missing_joints: M, landmarks not visible, summed over the clip.
        jitter: J, normalised image units, summed over the clip.
        stability_score: M + J; lower is steadier.
        missing_joints_per_frame, jitter_per_frame: M and J divided by the number of frames.
        score_per_second: M as of thirty frames a second plus J, divided by the length of the clip,
            1/s: the sum favours short clips and low frame rates.
    """

    SCHEMA = STABILITY_SCORE

    frames: int
    detected: int
    missing_joints: int
    jitter: float
    stability_score: float
    missing_joints_per_frame: float
    jitter_per_frame: float
    score_per_second: float

    def to_columns(self) -> tuple[Columns, Facts]:
        """Return the columns and the metadata of the table."""
        names = (column.name for column in STABILITY_SCORE.columns)
        return {name: np.array([getattr(self, name)]) for name in names}, {}

    @classmethod
    def from_columns(cls, columns: Columns, facts: Facts) -> "Stability":
        """Build the object from columns and metadata."""
        return cls(**{name: values[0].item() for name, values in columns.items()})


def stability(track: LandmarkTrack, config: StabilityConfig) -> Stability:
    """Return M + J of a track; a clip without a person has M = 33 T and J = 0."""
    frames = len(track)
    missing = missing_joints(track.visibility, config.visibility_threshold)
    moved = jitter(track.landmarks[..., :2])
    return Stability(
        frames=frames,
        detected=int(track.detected.sum()),
        missing_joints=missing,
        jitter=moved,
        stability_score=missing + moved,
        missing_joints_per_frame=missing / max(frames, 1),
        jitter_per_frame=moved / max(frames, 1),
        score_per_second=(missing * USUAL_FPS + moved * track.fps) / max(frames, 1),
    )


def missing_joints(visibility: Float[np.ndarray, "T 33"], threshold: float) -> int:
    """Return M: landmarks under the threshold, and all 33 of every undetected (NaN) frame."""
    return int(np.count_nonzero(~(visibility >= threshold)))


def jitter(xy: Float[np.ndarray, "T 33 2"]) -> float:
    """Return the mean landmark displacement between consecutive frames, summed over the clip.

    J = sum_t 1/N sum_j |L_j,t - L_j,t-1|_2   (Algorithm 1; N = 33)

    Args:
        xy: Landmark positions, normalised image coordinates; NaN in undetected frames, whose steps
            count nothing (their landmarks count in M).
    Returns:
        Jitter in normalised image units; lower is steadier.
    """
    steps = np.linalg.norm(np.diff(xy, axis=0), axis=-1).sum(-1) / LANDMARKS
    return float(np.nansum(steps))
