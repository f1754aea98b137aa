"""A human motion as a table of text: a head, then a row a frame, for spreadsheets and plots.

time_s; x, y, z of HybrIK's 29 keypoints (metres, world); rx, ry, rz of the 24 joints (axis-angle,
radians, relative to the parent); state of the four contact points (0 air, 1 planted, 2 sliding).
"""

import io
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from robojackson.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES
from robojackson.errors import BadTable
from robojackson.formats.foreign_motion import (
    ForeignMotion,
    body_vectors,
    matrices,
    rows,
    skeleton_under,
)
from robojackson.formats.format import Importer, PersonExporter
from robojackson.motion.smpl_sequence import CONTACT_POINTS, SmplSequence

WHERE = "motion csv"
PLACES = [f"{name}_{axis}" for name in KEYPOINT_NAMES for axis in "xyz"]
TURNS = [f"{name}_r{axis}" for name in JOINT_NAMES for axis in "xyz"]
FIRST_LINE = 2
"""Of the numbers, below the head."""
STEP_TOLERANCE = 0.5
"""Share of the usual step by which another one may differ: a spreadsheet rounds."""
HEAD = ["time_s", *PLACES, *TURNS, *(f"contact_{name}" for name in CONTACT_POINTS)]


def write(sequence: SmplSequence) -> bytes:
    """Return the csv of a motion, eight decimals."""
    table = np.column_stack(
        [
            np.arange(len(sequence)) / sequence.fps,
            sequence.keypoints_w.reshape(len(sequence), -1),
            body_vectors(sequence),
            sequence.contact,
        ]
    )
    sink = io.StringIO()
    kinds = ["%.8f"] * (len(HEAD) - len(CONTACT_POINTS)) + ["%d"] * len(CONTACT_POINTS)
    np.savetxt(sink, table, fmt=kinds, delimiter=",", header=",".join(HEAD), comments="")
    return sink.getvalue().encode()


def read(data: bytes) -> ForeignMotion:
    """Return the motion of a csv that `write` wrote; the skeleton is computed from the frames.

    Raises:
        BadTable: not such a file.
    """
    try:
        head, _, body = data.decode("utf-8-sig").partition("\n")
        if head.strip().split(",") != HEAD or not body.strip():
            raise ValueError("empty, or its head is not that of `robojackson export --to csv`")
        lines = {
            number: line.split(",")
            for number, line in enumerate(body.splitlines(), FIRST_LINE)
            if line.strip()
        }
        if odd := [number for number, line in lines.items() if len(line) != len(HEAD)]:
            raise ValueError(f"cut off or damaged: line {odd[0]} has not {len(HEAD)} numbers")
        table = np.array([*lines.values()], float)
    except (ValueError, UnicodeDecodeError) as cause:
        raise BadTable(f"{WHERE}: {cause}") from cause
    table = rows({"table": table}, "table", len(HEAD), WHERE)
    points = table[:, 1 : 1 + len(PLACES)].reshape(-1, len(KEYPOINT_NAMES), 3)
    rotations = matrices(table[:, 1 + len(PLACES) :][:, : len(TURNS)])
    rest = skeleton_under(rotations, points)
    return ForeignMotion(_rate(table[:, 0], [*lines]), rotations, points[:, 0], rest)


def _rate(time_s: Float[np.ndarray, " T"], lines: Sequence[int]) -> float:
    """Return frames a second; raise `BadTable` at the first line off the usual step of time."""
    steps = np.diff(time_s)
    usual = float(np.median(steps))
    off = np.flatnonzero((steps <= 0.0) | (np.abs(steps - usual) > STEP_TOLERANCE * usual))
    if len(off):
        before, after = time_s[off[0] : off[0] + 2]
        raise BadTable(
            f"{WHERE}: line {lines[off[0] + 1]}: time_s goes from {before:.4g} to {after:.4g}, the "
            f"usual step is {usual:.4g} s: rows are missing, repeated or out of order; export it "
            "again, or write the times of evenly spaced frames"
        )
    return round(float(len(steps) / (time_s[-1] - time_s[0])), 5)


EXPORT = PersonExporter("csv", write)
IMPORT = Importer("csv", read, lambda file: file.head.startswith(b"time_s,"))
