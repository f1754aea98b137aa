"""Error by what a clip shows: joint, view, inclination, speed, size of the person.

    python -m benchmarks.mocap.strata [--renders FOLDER...] [--clips CLIP...]

Distance of each of twelve joints after a Procrustes fit a frame, mm, of raw BlazePose and of ours,
over the frames and joints of a stratum. Default clips: those that nothing was tuned on, and the
real ones; FOLDER holds renders of `fresh` or `floor_moves`. View: angle between where the trunk
faces and the camera. Inclination: of the trunk to the vertical. Speed: of the true joint, seen from
the hips. Size: from the highest to the lowest landmark.
"""

import argparse
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float
from rich.console import Console
from rich.table import Table

from benchmarks.mocap import fresh
from benchmarks.mocap.breakdown import GROUP_OF, GROUPS, MARKS, errors
from benchmarks.mocap.camera_pairs import detected
from benchmarks.mocap.steadiness import joints
from benchmarks.mocap.truth import HELD_OUT, JOINTS, REAL, Truth, load_truth, video_path
from robojackson.body.forward_kinematics import unit
from robojackson.clips.people.person_extent import heights_px
from robojackson.clips.pose_detector import detect
from robojackson.clips.video import VideoLimits, probe
from robojackson.errors import NoPersonFound
from robojackson.metrics.pose_error import procrustes
from robojackson.mocap.landmarks.blazepose import fill_gaps
from robojackson.mocap.recover import MocapConfig, recover_motion
from robojackson.motion.landmark_track import LandmarkTrack

HIPS, SHOULDERS = (0, 1), (6, 7)
BINS: dict[str, tuple[tuple[float, ...], str]] = {
    "view": ((0.0, 45.0, 90.0, 135.0, 181.0), "degrees from the front"),
    "inclination": ((0.0, 20.0, 45.0, 90.0, 181.0), "degrees from upright"),
    "speed": ((0.0, 0.25, 1.0, 2.5, 99.0), "m/s"),
    "size": ((0.0, 150.0, 300.0, 600.0, 9999.0), "pixels"),
    "rate": ((0.0, 12.0, 20.0, 45.0, 999.0), "frames a second"),
}
"""Edges of the strata, and their unit."""
Columns = dict[str, np.ndarray]


def columns(track: LandmarkTrack, truth: Truth, raw: Float[np.ndarray, "T 12 3"]) -> Columns:
    """Return errors and strata of every joint of every frame, each of shape (T, 12)."""
    ours = joints(recover_motion(track, MocapConfig()))
    count = min(len(ours), len(raw), len(truth.joints))
    goal = truth.joints[:count]
    before_camera = procrustes(goal, raw[:count])(goal)
    each = {
        "raw": errors(raw, truth)[:count],
        "ours": errors(ours, truth)[:count],
        "speed": _speed(goal, track.fps),
        "view": _view_deg(before_camera)[:, None],
        "inclination": _inclination_deg(before_camera, truth.up_c)[:, None],
        "size": np.nan_to_num(heights_px(track)[:count])[:, None],
        "rate": np.full((count, 1), track.fps),
        "joint": np.arange(len(JOINTS))[None],
    }
    return {name: np.broadcast_to(value, (count, len(JOINTS))) for name, value in each.items()}


def _speed(goal: Float[np.ndarray, "T 12 3"], fps: float) -> Float[np.ndarray, "T 12"]:
    local = goal - goal[:, HIPS].mean(1, keepdims=True)
    return np.asarray(np.linalg.norm(np.gradient(local, axis=0), axis=-1) * fps)


def _view_deg(points: Float[np.ndarray, "T 12 3"]) -> Float[np.ndarray, " T"]:
    """Return the angle between the trunk's front and the direction to the camera (-z), degrees."""
    across = points[:, SHOULDERS[0]] - points[:, SHOULDERS[1]]
    front = unit(np.cross(across, _trunk(points)))
    return np.asarray(np.degrees(np.arccos(np.clip(-front[:, 2], -1.0, 1.0))))


def _inclination_deg(points: Float[np.ndarray, "T 12 3"], up: np.ndarray) -> np.ndarray:
    return np.asarray(np.degrees(np.arccos(np.clip(unit(_trunk(points)) @ up, -1.0, 1.0))))


def _trunk(points: np.ndarray) -> np.ndarray:
    return np.asarray(points[:, SHOULDERS].mean(1) - points[:, HIPS].mean(1))


def clips(
    names: list[str], folders: list[Path]
) -> Iterator[tuple[LandmarkTrack, Truth, Float[np.ndarray, "T 12 3"]]]:
    """Yield bundled clips and renders with their truth and the joints of raw BlazePose."""
    for name in names:
        path = video_path(name)
        first = detect(path, probe(path, VideoLimits()), "full")
        raw = fill_gaps(first.world_landmarks, first.detected)[:, MARKS]
        yield detected(name), load_truth(name), raw
    for path in sorted(path for folder in folders for path in folder.glob("*.npz")):
        try:
            yield *fresh.read(path), fresh.raw_joints(path)
        except NoPersonFound:
            continue


def table(found: Columns) -> Table:
    """Return the errors by stratum; strata of fewer than 30 frames are left out."""
    result = Table("by", "stratum", "frames", "raw", "ours", "change")

    def row(by: str, stratum: str, chosen: np.ndarray) -> None:
        frames = chosen.any(1).sum()
        if frames < 30:
            return
        raw, ours = (found[name][chosen].mean() for name in ("raw", "ours"))
        result.add_row(
            by, stratum, str(frames), f"{raw:.0f}", f"{ours:.0f}", f"{ours / raw - 1:+.0%}"
        )

    row("all", "", np.ones_like(found["raw"], bool))
    for group in GROUPS:
        row("joint", group, np.isin(found["joint"], np.flatnonzero(group == GROUP_OF)))
    for by, (edges, unit_name) in BINS.items():
        for low, high in pairwise(edges):
            inside = (found[by] >= low) & (found[by] < high)
            row(by, f"{low:g} to {high:g} {unit_name}", inside)
    return result


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--clips", nargs="*", default=[*HELD_OUT, *REAL])
    parser.add_argument("--renders", type=Path, nargs="*", default=[])
    options = parser.parse_args()
    parts = [columns(*each) for each in clips(options.clips, options.renders)]
    found = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    Console(width=100).print(table(found))


if __name__ == "__main__":
    main()
