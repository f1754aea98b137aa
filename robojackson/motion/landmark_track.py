"""Landmarks of one person: one row a frame, NaN where no person was detected."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from robojackson.files.fact_types import Count, Matrix, Number, Pixels, Rate, Segment, Texts
from robojackson.files.table_file import Columns, Facts, TableFile, numbered
from robojackson.files.table_types import F32, F64, I32, Column, TableSchema

LANDMARKS = 33
ARRAYS = ("landmarks", "world_landmarks", "visibility")
FACTS = ("fps", "width", "height", "person", "notes", "people", "brightness", "sharpness")
LONGEST_STEP_S, LONGEST_STEP = 0.15, 2.5
"""Two pictures further apart than both, seconds and mean periods, have a hole between them."""
EVEN = 0.25
"""Frames that are off their place on an even grid by no more than this are evenly spaced."""

LANDMARK_TRACK = TableSchema(
    "LandmarkTrack",
    "frame",
    (
        Column("frame", I32),
        Column("time_s", F64, "s"),
        Column("landmarks", F32, "1", "image, divided by width and height", 99, nullable=True),
        Column("world_landmarks", F32, "m", "hips: x right, y down, z away", 99, nullable=True),
        Column("visibility", F32, "1", width=33, nullable=True),
    ),
    {"fps": Rate, "width": Pixels, "height": Pixels},
    {
        **{"person": Count, "notes": Texts, "people": Count, "brightness": Number | None},
        **{"sharpness": Number | None, "to_first": list[Matrix]},
        "edges": list[Segment],
    },
)


@dataclass(frozen=True, repr=False)
class LandmarkTrack(TableFile):
    """BlazePose landmarks of one person through a clip.

    Attributes:
        fps: Frames a second of the clip, the mean without pauses where they are not evenly spaced.
        width, height: Size of the upright image, pixels.
        landmarks: Image coordinates divided by width and height, z in the scale of x.
        world_landmarks: Metres, origin between the hips, x right, y down, z away from the camera.
        visibility: 0..1 a landmark, as the detector estimates it.
        time_s: Seconds since the first frame; None where frame t is at t / fps.
        person: Number of the person among those in the clip, the largest is 1; 0 for one alone.
        notes: Warnings about how the person was detected.
        to_first: Takes pixels of each frame to those of the first, for a camera that moved; None
            where it stood.
        people: Number of people that were identified; 0 for a single person.
        brightness: Mean grey level of the person, 0..1; None where it was not measured.
        sharpness: Share of the person's contrast that is fine detail; None as before.
        edges: Ends (x0, y0, x1, y1) of straight edges of the scene, pixels, of a camera that moved
            those of the first frame; None where none were sought.
    """

    SCHEMA = LANDMARK_TRACK

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
    people: int = 0
    brightness: float | None = None
    sharpness: float | None = None
    edges: Float[np.ndarray, "N 4"] | None = None

    def __len__(self) -> int:
        return len(self.landmarks)

    def __repr__(self) -> str:
        seen = f"{int(self.detected.sum())} of {len(self)} frames"
        return (
            f"LandmarkTrack({seen} at {self.fps:g} fps, {self.width} x {self.height} px, "
            f"person={self.person})"
        )

    @property
    def detected(self) -> np.ndarray:
        """True in frames where a person was found, shape (T,)."""
        result: np.ndarray = ~np.isnan(self.landmarks[:, 0, 0])
        return result

    @property
    def times(self) -> Float[np.ndarray, " T"]:
        """When each frame was taken, seconds since the first."""
        return np.arange(len(self)) / self.fps if self.time_s is None else self.time_s

    def to_columns(self) -> tuple[Columns, Facts]:
        """Return the columns and the metadata of the table."""
        columns = numbered("frame", len(self), 1.0 / self.fps) | {"time_s": self.times}
        columns |= {name: getattr(self, name) for name in ARRAYS}
        facts = {name: getattr(self, name) for name in FACTS}
        if self.to_first is not None:
            facts["to_first"] = self.to_first.tolist()
        if self.edges is not None:
            facts["edges"] = self.edges.tolist()
        return columns, facts

    @classmethod
    def from_columns(cls, columns: Columns, facts: Facts) -> "LandmarkTrack":
        """Build the object from columns and metadata."""
        time_s, fps = columns["time_s"], float(facts["fps"])
        return cls(
            fps=fps,
            width=int(facts["width"]),
            height=int(facts["height"]),
            landmarks=columns["landmarks"].reshape(-1, LANDMARKS, 3),
            world_landmarks=columns["world_landmarks"].reshape(-1, LANDMARKS, 3),
            visibility=columns["visibility"],
            time_s=time_s if uneven(time_s, fps) else None,
            person=int(facts.get("person", 0)),
            notes=tuple(facts.get("notes", ())),
            to_first=np.array(facts["to_first"]) if "to_first" in facts else None,
            people=int(facts.get("people", 0)),
            brightness=facts.get("brightness"),
            sharpness=facts.get("sharpness"),
            edges=np.reshape(facts["edges"], (-1, 4)) if "edges" in facts else None,
        )

    def nearest(self, time_s: float) -> int:
        """Return the frame that was taken next to a time, seconds since the first."""
        return int(np.abs(self.times - time_s).argmin())


def uneven(time_s: Float[np.ndarray, " T"], fps: float) -> bool:
    """Return whether frames lie off an even grid of that rate, as in a phone's variable frame
    rate."""
    grid = np.arange(len(time_s)) / fps
    return bool((np.abs(time_s - grid) * fps > EVEN).any())


def even_times(track: LandmarkTrack) -> Float[np.ndarray, " T"]:
    """Return the times at equal spaces of 1 / fps from the first frame to the last, seconds."""
    last = float(track.times[-1])
    return np.minimum(np.arange(round(last * track.fps) + 1) / track.fps, last)


def evenly(track: LandmarkTrack) -> LandmarkTrack:
    """Return the same motion at equal spaces of 1 / fps, as the stages after this one need it.

    Linear between two frames; a frame next to a gap has no person, nor has one in a hole, in which
    the camera took no pictures.
    """
    if track.time_s is None:
        return track
    when = even_times(track)
    after = np.clip(np.searchsorted(track.time_s, when), 1, max(len(track) - 1, 1))
    before = after - 1
    span = np.maximum(track.time_s[after] - track.time_s[before], 1e-9)
    share = np.clip((when - track.time_s[before]) / span, 0.0, 1.0)
    hole = (span > max(LONGEST_STEP_S, LONGEST_STEP / track.fps)) & (share > 0.0) & (share < 1.0)

    def at(values: np.ndarray) -> np.ndarray:
        weight = share.reshape(-1, *[1] * (values.ndim - 1))
        mixed = (1.0 - weight) * values[before] + weight * values[after]
        return np.where(
            weight == 0.0, values[before], np.where(weight == 1.0, values[after], mixed)
        )

    def seen(values: np.ndarray) -> np.ndarray:
        return np.where(hole.reshape(-1, *[1] * (values.ndim - 1)), np.nan, at(values))

    return replace(
        track,
        landmarks=seen(track.landmarks),
        world_landmarks=seen(track.world_landmarks),
        visibility=seen(track.visibility),
        time_s=None,
        to_first=None if track.to_first is None else at(track.to_first),
    )
