"""Our solve against real outputs of the official code, from the user (`ROBOJACKSON_PAPER`).

Figures of each file: how far our analytic solve ends from HybrIK's own 29 joints when it is given
its joints and twists on a skeleton of their median lengths; how much a constant twist in place of
its learned ones turns the joints; and, where a video of the same name lies beside the file, how far
our motion of that video is from HybrIK's (`agreement`).
"""

from pathlib import Path

import numpy as np

from benchmarks.mocap.agreement import rows
from robojackson.body import analytic_solve
from robojackson.body.forward_kinematics import forward
from robojackson.clips.people.dancer import DancerConfig
from robojackson.clips.video import VideoLimits, probe
from robojackson.formats import hybrik_output
from robojackson.formats.foreign_motion import HybrikMotion
from robojackson.mocap.landmarks.landmark_pipeline import detect_landmarks
from robojackson.mocap.networks.network_config import NetworkConfig
from robojackson.mocap.networks.smpl_body import measured_rest
from robojackson.mocap.pose.twist import prior

FILES, VIDEOS = (".pt", ".pk"), (".mp4", ".mov", ".avi", ".webm")


def compare(folder: Path) -> dict[str, dict[str, object]]:
    """Return the figures of every file of a folder."""
    files = sorted(file for file in folder.iterdir() if file.suffix in FILES)
    return {file.name: _compared(file) for file in files}


def _compared(file: Path) -> dict[str, object]:
    theirs = hybrik_output.read(file.read_bytes())
    found: dict[str, object] = {"frames": len(theirs), **_solved(theirs)}
    videos = [file.with_suffix(suffix) for suffix in VIDEOS if file.with_suffix(suffix).is_file()]
    for video in videos:
        info = probe(video, VideoLimits())
        track = detect_landmarks(video, info, "full", DancerConfig())
        found["agreement"] = rows(video, track, theirs, NetworkConfig())
    return found


def _solved(theirs: HybrikMotion) -> dict[str, float]:
    rest = measured_rest(theirs.points)
    turns = np.broadcast_to(prior(), theirs.twist.shape)
    learned, constant = (
        analytic_solve.solve(theirs.points, rest[None], t) for t in (theirs.twist, turns)
    )
    reached = forward(learned, rest[None], theirs.points[:, 0]).points
    trace = np.einsum("tjab,tjab->tj", learned, constant)
    angle = np.degrees(np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0)))
    return {
        "solve_mm": float(1e3 * np.linalg.norm(reached - theirs.points, axis=-1).mean()),
        "constant_twist_deg": float(angle.mean()),
    }
