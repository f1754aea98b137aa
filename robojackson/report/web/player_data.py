"""Data of the page's player: one clock, four panes, bands of time and curves.

Every row is a picture of the timeline of the rendered video, so that one index selects all panes.
World frame, metres, radians, seconds.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.metrics.rollout_score import heading_frame
from robojackson.mocap.reprojection import weak_frames
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import AIR, SmplSequence
from robojackson.report.video.timeline import (
    Timeline,
    cut_note,
    person_points,
    reference_qpos,
    timeline,
)
from robojackson.report.web.pane_camera import followed, followed_beside
from robojackson.report.web.shapes import body_poses, packed, person_shape, robot_shape
from robojackson.robot.model import Robot
from robojackson.robot.names import PELVIS

FAINT = 0.5
"""Mean confidence of the keypoints below which a stretch is marked."""
FAR = 0.5
"""Mean site error above which a stretch is marked, of the limit of strict success."""
CONTACT_CLASSES = {1: "on", 2: "slide"}
LEAST_SPAN = 2
"""Smallest length of a marked stretch, pictures, so that it is visible."""


@dataclass(frozen=True)
class Span:
    """Pictures [start, end) of a band.

    Attributes:
        kind: Class of its colour.
        title: Text of the band.
    """

    start: float
    end: float
    kind: str
    title: str


@dataclass(frozen=True)
class Band:
    """A row of the timeline."""

    title: str
    spans: Sequence[Span]


@dataclass(frozen=True)
class Player:
    """Everything of the player.

    Attributes:
        data: Shapes, motions and curves in JSON's types.
        bands: Rows of the timeline.
        when: Times of the pictures.
        error_m: Distance of each site from the reference's at every picture, in the frame of pelvis
            and heading, by name; empty without a rollout.
        points: Keypoints of dancer, reference and robot at every picture, metres.
        note: How much of a dance is shown that is longer than `max_seconds`; empty for a whole one.
    """

    data: dict[str, object]
    bands: list[Band]
    when: Timeline
    error_m: dict[str, Float[np.ndarray, " N"]]
    points: dict[str, Float[np.ndarray, "N K 3"]]
    note: str = ""

    @property
    def error_while_up(self) -> dict[str, Float[np.ndarray, " M"]]:
        """Return the errors of the pictures before the rollout ends."""
        return {name: error[~self.when.ended] for name, error in self.error_m.items()}


def player(
    track: LandmarkTrack,
    sequence: SmplSequence,
    reference: ReferenceMotion,
    rollout_qpos: Float[np.ndarray, "S nq"] | None,
    robot: Robot,
    fps: float,
    max_seconds: float,
) -> Player:
    """Return the panes, bands and curves of a run."""
    steps = 0 if rollout_qpos is None else len(rollout_qpos)
    when = timeline(reference, track.fps, len(sequence), steps, fps, max_seconds)
    target = reference_qpos(reference, when)
    poses, sites = body_poses(robot.model, target)
    sites = sites[:, robot.keypoint_sites]
    points = person_points(sequence, when)
    seen = followed(sites, target[:, :3], fps)
    data: dict[str, object] = {
        "fps": fps,
        "count": len(when),
        "robot": robot_shape(robot.model),
        "person": person_shape(),
        "body": {"points": packed(points), **followed(points, points[:, 0], fps).data},
        "reference": {"poses": packed(poses), **seen.data},
        "joints": [name.replace("_", " ") for name in reference.joint_names],
        "angles": packed(np.degrees(target[:, 7:])),
        "torque": _torques(reference, when),
        "liveliest": int(np.argmax(target[:, 7:].std(0))),
    }
    errors: dict[str, np.ndarray] = {}
    moved = {"person": points, "reference": sites}
    if rollout_qpos is not None and steps:
        danced = np.asarray(rollout_qpos, float)[when.rollout]
        own_poses, own_sites = body_poses(robot.model, danced)
        own_sites = own_sites[:, robot.keypoint_sites]
        pelvis = robot.keypoint_names.index(PELVIS)
        own, there = (
            heading_frame(points_w, qpos[:, 3:7], pelvis)
            for points_w, qpos in ((own_sites, danced), (sites, target))
        )
        apart = np.linalg.norm(own - there, axis=-1)
        moved["robot"] = own_sites
        errors = dict(zip(robot.keypoint_names, apart.T, strict=True))
        camera = followed_beside(own_sites, danced[:, :3], fps, seen)
        data["trained"] = {"poses": packed(own_poses), **camera.data}
        data["trained_angles"] = packed(np.degrees(danced[:, 7:]))
        data["error"] = packed(1000 * apart.mean(1))
        data["ended"] = int(np.argmax(when.ended)) if when.ended.any() else len(when)
    bands = _contact_bands(sequence, reference, robot, when)
    far_m = FAR * robot.description.strict.sites
    bands.append(Band("look here", attention(sequence, reference, when, errors, track, far_m)))
    shown = [band for band in bands if band.spans]
    return Player(data, shown, when, errors, moved, cut_note(reference, len(when) / fps, fps))


def _torques(reference: ReferenceMotion, when: Timeline) -> str | None:
    ratio = np.asarray(reference.torque_ratio)
    if ratio.shape[1] != len(reference.joint_names):
        return None
    return packed(100 * ratio[when.step])


def _contact_bands(
    sequence: SmplSequence, reference: ReferenceMotion, robot: Robot, when: Timeline
) -> list[Band]:
    """Return the states of the feet of person and reference, whatever its contacts are called."""
    side_of = {name: point.side for name, point in robot.description.contacts.items()}
    frames = np.minimum(when.frame, len(sequence) - 1)
    bands = []
    for column, side in ((0, "left"), (2, "right")):
        contact = np.asarray(sequence.contact)[frames, column : column + 2]
        state = np.where((contact == AIR).all(1), 0, np.where((contact == 1).any(1), 1, 2))
        bands.append(Band(f"person, {side} foot", _spans(state)))
    for side in ("left", "right"):
        own = [i for i, name in enumerate(reference.contact_names) if side_of.get(name) == side]
        contact = np.asarray(reference.contact)[when.step][:, own]
        if own:
            state = np.where((contact == AIR).all(1), 0, np.where((contact == 1).any(1), 1, 2))
            bands.append(Band(f"reference, {side} foot", _spans(state)))
    return bands


def _spans(state: Int[np.ndarray, " N"]) -> list[Span]:
    words = {1: "planted", 2: "sliding"}
    return [
        Span(start, end, CONTACT_CLASSES[kind], words[kind])
        for start, end, kind in _runs(state)
        if kind in words
    ]


def attention(
    sequence: SmplSequence,
    reference: ReferenceMotion,
    when: Timeline,
    errors: dict[str, Float[np.ndarray, " N"]],
    track: LandmarkTrack,
    far_m: float,
) -> list[Span]:
    """Return the bad stretches, by cause.

    Args:
        far_m: Mean site error above which a robot is off the dance, metres.
    """
    frames = np.minimum(when.frame, len(sequence) - 1)
    marks: dict[str, Bool[np.ndarray, " N"]] = {
        "body filled in": ~np.asarray(sequence.valid)[frames],
        "body off the picture": weak_frames(sequence, track)[frames],
        "body uncertain": np.asarray(sequence.confidence)[frames].mean(1) < FAINT,
    }
    if reference.certificate is not None:
        marks["beyond the robot"] = np.asarray(reference.certificate.slack)[when.step] > 1
    if errors:
        apart = np.mean(list(errors.values()), 0)
        marks["robot off the dance"] = (apart > far_m) & ~when.ended
        marks["robot has fallen or ended"] = when.ended
    found = []
    for title, bad in marks.items():
        kind = "bad" if title.startswith("robot") else "weak"
        for start, end, is_bad in _runs(bad.astype(int)):
            if is_bad:
                found.append(Span(start, max(end, start + LEAST_SPAN), kind, title))
    return found


def _runs(values: Int[np.ndarray, " N"]) -> list[tuple[int, int, int]]:
    """Return (start, end, value) of every stretch of one value."""
    found, start = [], 0
    for value, group in groupby(values.tolist()):
        end = start + len(list(group))
        found.append((start, end, int(value)))
        start = end
    return found
