"""Joint errors of the mocap stage on the bundled clips that have a truth (`make bench`).

Rows of each clip: raw BlazePose (full) world landmarks; the same through a zero-phase filter of
6 Hz; our motion. Twelve joints; millimetres. PA: after a similarity a frame. RR: relative to the
middle of the hips, after one rotation a clip, no scale. Contacts of the rendered clips: F1 of
planted and of touching points against the drawn feet.

hip_shake, dance_a, dance_b and walk are rendered, person_cam1-4 are real (four views of one motion,
so tuning on one is tuning on all). Tuned on what: the prior of swapped sides on person_cam2; the
weights of the gravity estimate and of the refinement, the low-pass (4 Hz), the usual focal length
(0.85 of the diagonal) and the factor of BlazePose's metre (1.05) by a few trials on all eight. So
no row is held out; nothing is fitted to a single clip when it runs.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.truth import HIPS, JOINTS, REAL, RENDERED, Truth, load_truth, video_path
from robojackson.clips.landmarks import detect
from robojackson.clips.video import VideoLimits, probe
from robojackson.metrics import motion, pose
from robojackson.mocap.blazepose import fill_gaps, landmark
from robojackson.mocap.body import pose_sequence
from robojackson.mocap.contacts import ContactConfig, contacts
from robojackson.mocap.feet import foot_points
from robojackson.mocap.recover import MocapConfig, recover
from robojackson.mocap.skeleton import keypoint
from robojackson.mocap.smooth import lowpass
from robojackson.motion.smpl import AIR, PLANTED, SmplSequence

RESULTS = Path(__file__).parent / "results" / "mocap.json"
Figures = dict[str, float]
Row = dict[str, Any]
FILTER_HZ = 6.0


def measure(clip: str, size: str, config: MocapConfig) -> Row:
    """All figures of one clip."""
    truth, path = load_truth(clip), video_path(clip)
    started = time.perf_counter()
    track = detect(path, probe(path, VideoLimits()), size)
    detected = time.perf_counter()
    sequence = recover(track, config)
    ended = time.perf_counter()
    raw = fill_gaps(track.world_landmarks, track.detected)[:, [landmark(n) for n in JOINTS]]
    return {
        "clip": clip,
        "frames": len(track),
        "detected": int(track.detected.sum()),
        "raw": errors(raw, truth, track.fps),
        "filtered": errors(lowpass(raw, track.fps, FILTER_HZ), truth, track.fps),
        "ours": errors(sequence.joints[:, [keypoint(n) for n in JOINTS]], truth, track.fps),
        "motion": floor_figures(sequence),
        "contacts": contact_figures(sequence, truth),
        "tilt_error_deg": tilt_error_deg(sequence, truth),
        "detect_fps": len(track) / (detected - started),
        "recover_fps": len(track) / (ended - detected),
    }


def errors(joints: np.ndarray, truth: Truth, fps: float) -> Figures:
    """PA-MPJPE and root-relative MPJPE in mm, MPJVE in mm/s, ratio of mean joint speeds."""
    count = min(len(joints), len(truth.joints))
    mine, right = joints[:count], truth.joints[:count]
    aligned, goal = pose.align_clip(mine, right, HIPS), pose.root_relative(right, HIPS)
    still = np.zeros_like(goal)
    return {
        "pa_mpjpe_mm": 1e3 * pose.pa_mpjpe(mine, right),
        "rr_mpjpe_mm": 1e3 * pose.mpjpe(aligned, goal),
        "mpjve_mm_s": 1e3 * pose.mpjve(aligned, goal, fps),
        "speed_ratio": pose.mpjve(aligned, still, fps) / pose.mpjve(goal, still, fps),
    }


def floor_figures(sequence: SmplSequence) -> Figures:
    """How the motion treats the floor."""
    feet = foot_points(pose_sequence(sequence), sequence.rest_joints)
    planted = sequence.contact == PLANTED
    return {
        "planted_share": float(planted.mean()),
        "unsupported_share": float((sequence.contact == 0).all(1).mean()),
        "planted_slide_cm_s": 100.0 * motion.foot_slide(feet, planted, sequence.fps),
        "penetration_mm": 1e3 * motion.floor_penetration(feet),
        "jerk_m_s3": motion.jerk(sequence.joints, sequence.fps),
    }


def contact_figures(sequence: SmplSequence, truth: Truth) -> Figures:
    """F1 of the states of the foot points, and their slide where the truth says planted."""
    if truth.feet is None:
        return {}
    count = min(len(sequence), len(truth.feet))
    grounded = np.zeros(count, bool)
    config = ContactConfig(depth_weight=1.0)
    goal = contacts(truth.feet[:count], grounded, sequence.fps, config)
    ours = sequence.contact[:count]
    feet = foot_points(pose_sequence(sequence), sequence.rest_joints)[:count]
    stands = goal == PLANTED
    return {
        "planted_f1": f1(ours == PLANTED, stands),
        "touching_f1": f1(ours != AIR, goal != AIR),
        "slide_cm_s": 100.0 * motion.foot_slide(feet, stands, sequence.fps),
        "true_slide_cm_s": 100.0 * motion.foot_slide(truth.feet[:count], stands, sequence.fps),
    }


def f1(found: np.ndarray, true: np.ndarray) -> float:
    """Harmonic mean of precision and recall; 1 where there is nothing to find and nothing found."""
    total = found.sum() + true.sum()
    return float(2.0 * (found & true).sum() / total) if total else 1.0


def tilt_error_deg(sequence: SmplSequence, truth: Truth) -> float:
    """Angle between the estimated and the true vertical, degrees."""
    up = np.array(sequence.camera["rotation_w"])[2]
    return float(np.degrees(np.arccos(np.clip(up @ truth.up_c, -1.0, 1.0))))


def table(rows: list[Row]) -> Table:
    """What is printed."""
    shown = Table(title="Mocap: mm, raw / same filter / ours")
    for head in ("clip", "PA-MPJPE", "RR-MPJPE", "MPJVE mm/s", "speed ratio", "tilt error", "slide",
                 "planted", "contact F1", "frames/s"):  # fmt: skip
        shown.add_column(head, justify="left" if head == "clip" else "right")
    for row in rows:
        cells = [_three(row, key) for key in ("pa_mpjpe_mm", "rr_mpjpe_mm", "mpjve_mm_s")]
        floor = row["motion"]
        shown.add_row(
            str(row["clip"]),
            *cells,
            f"{row['ours']['speed_ratio']:.2f}",
            f"{row['tilt_error_deg']:.1f} deg",
            f"{floor['planted_slide_cm_s']:.1f} cm/s",
            f"{100 * floor['planted_share']:.0f} %",
            f"{row['contacts']['touching_f1']:.2f}" if row["contacts"] else "-",
            f"{row['detect_fps']:.0f} + {row['recover_fps']:.0f}",
        )
    return shown


def means(rows: list[Row]) -> dict[str, dict[str, Figures]]:
    """Mean of each figure over the rendered and over the real clips."""
    groups = {"rendered": RENDERED, "real": REAL}
    return {
        name: {
            kind: {
                key: float(np.mean([row[kind][key] for row in rows if row["clip"] in clips]))
                for key in ("pa_mpjpe_mm", "rr_mpjpe_mm", "mpjve_mm_s")
            }
            for kind in ("raw", "filtered", "ours")
        }
        for name, clips in groups.items()
        if any(row["clip"] in clips for row in rows)
    }


def main(arguments: list[str] | None = None) -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--clips", nargs="*", default=[*RENDERED, *REAL])
    parser.add_argument("--size", default="full", help="pose model: lite, full or heavy")
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args(arguments)
    rows = [measure(clip, options.size, MocapConfig()) for clip in options.clips]
    Console(width=170).print(table(rows))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    result = {"size": options.size, "rows": rows, "means": means(rows), "tuned": __doc__}
    options.out.write_text(json.dumps(result, indent=1) + "\n")


def _three(row: Row, key: str) -> str:
    return " / ".join(f"{row[kind][key]:.0f}" for kind in ("raw", "filtered", "ours"))


if __name__ == "__main__":
    main()
