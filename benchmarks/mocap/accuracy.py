"""Errors of the mocap stage on clips that have a truth (`make bench-mocap`).

Rows of each clip: raw BlazePose (full) world landmarks; the same through a zero-phase filter of
6 Hz; our motion after step 1 (keypoints, repair, bones), after step 2 (whole-clip refinement),
after step 3 (our temporal NIKI), and `best` (full and heavy vote; only where the heavy model is
installed). Twelve joints; `figures` defines each figure, loops' seams are masked by
three frames. What was tuned on what stands in `TUNED`; tuned clips stay out of the headline mean,
which is that of `HELD_OUT`. Speeds are frames a CPU second of one core.
"""

import argparse
import json
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from benchmarks.mocap import accuracy_report, figures, official
from benchmarks.mocap.truth import HELD_OUT, JOINTS, REAL, RENDERED, Truth, load_truth, video_path
from robojackson.body import analytic_solve
from robojackson.body.skeleton import REST_JOINTS, keypoint
from robojackson.body.smoothing import lowpass
from robojackson.clips.people.dancer import DancerConfig
from robojackson.clips.pose_detector import ASSETS, detect
from robojackson.clips.video import VideoLimits, probe
from robojackson.mocap.landmarks.blazepose import fill_gaps, landmark
from robojackson.mocap.landmarks.landmark_pipeline import detect_landmarks
from robojackson.mocap.landmarks.model_fusion import fuse_tracks
from robojackson.mocap.landmarks.refinement import RefineConfig
from robojackson.mocap.pose.twist import prior
from robojackson.mocap.recover import MocapConfig, recover_motion
from robojackson.motion.landmark_track import LandmarkTrack

RESULTS = Path(__file__).parents[1] / "results"
PAPER = "ROBOJACKSON_PAPER"
FILTER_HZ = 6.0
SOLVE_FRAMES, SOLVE_BATCHES = 300, 20
GROUPS = {"held_out": HELD_OUT, "rendered": RENDERED[1:], "real": REAL}
TUNED = {
    "person_cam2": "the prior of swapped sides",
    "dance_a, dance_b, walk": "contact model, pins and ramps",
    "dance_a, dance_b": "window and least turn of a foot that pivots",
    "all of rendered and real": "weights of gravity and of the refinement, 4 Hz low-pass, focal "
    "length (0.85 of the diagonal), metre (1.05), height of the hips, trust in bone lengths",
    "19 of the network's training clips": "speed of feet along the ray, leash of the root's path",
    "held_out": "shares of the former weights and of the answer without depth, trust in the "
    "detector's depth, weights of gravity: by these and the tuned clips; nothing before",
}

Row = dict[str, Any]


@dataclass(frozen=True)
class Seen:
    """A clip as the benchmark sees it.

    Attributes:
        truth: What is true of it.
        raw: What the full model saw in the order of the clip, in one pass.
        tracks: What is detected by each quality.
        detect_fps: Frames a CPU second of the full model.
    """

    truth: Truth
    raw: LandmarkTrack
    tracks: Mapping[str, LandmarkTrack]
    detect_fps: float


def look(clip: str) -> Seen:
    """Return both pose models over a clip."""
    path = video_path(clip)
    info = probe(path, VideoLimits())
    raw = detect(path, info, "full")
    began = time.process_time()
    tracks = {"full": detect_landmarks(path, info, "full", DancerConfig())}
    spent = time.process_time() - began
    if heavy_installed():
        heavy = detect(path, info, "heavy")
        tracks["best"] = fuse_tracks([tracks["full"], heavy])
    return Seen(load_truth(clip), raw, tracks, len(tracks["full"]) / spent)


def heavy_installed() -> bool:
    """Return whether the larger pose model is there; `tools.assets.build_pose_models` builds it."""
    return (ASSETS / "pose_landmarker_heavy.task").is_file()


def configurations() -> dict[str, tuple[str, MocapConfig]]:
    """Return the row -> the track and the configuration that it measures."""
    whole = MocapConfig()
    plain, learned = (with_temporal(whole, enabled) for enabled in (False, True))
    first = replace(plain, refine=RefineConfig(enabled=False))
    rows = {"step 1": ("full", first), "step 2": ("full", plain), "step 3": ("full", learned)}
    if heavy_installed():
        rows["best"] = ("best", whole)
    return rows


def default_row() -> str:
    """Return the row that is measured with the default configuration."""
    return "step 3" if MocapConfig().temporal.enabled else "step 2"


def with_temporal(config: MocapConfig, enabled: bool) -> MocapConfig:
    """Return the configuration with step 3 switched on or off."""
    return replace(config, temporal=replace(config.temporal, enabled=enabled))


def measure(clip: str) -> Row:
    """Return all rows of one clip."""
    seen = look(clip)
    track = seen.raw
    raw = fill_gaps(track.world_landmarks, track.detected)[:, [landmark(n) for n in JOINTS]]
    rows: dict[str, figures.Figures] = {
        "raw": {
            **figures.joint_errors(raw, seen.truth, track.fps),
            **figures.knee_figures(raw, seen.truth),
        },
        "filtered": figures.joint_errors(lowpass(raw, track.fps, FILTER_HZ), seen.truth, track.fps),
    }
    for name, (source, config) in configurations().items():
        rows[name] = motion_figures(seen.tracks[source], config, seen.truth)
    return {
        "clip": clip,
        "frames": len(track),
        "detected": int(track.detected.sum()),
        "detect_fps": seen.detect_fps,
        "rows": rows,
    }


def motion_figures(track: LandmarkTrack, config: MocapConfig, truth: Truth) -> figures.Figures:
    """Return all figures of the motion that one configuration makes of a track."""
    began = time.process_time()
    sequence = recover_motion(track, config)
    spent = time.process_time() - began
    joints = sequence.joints[:, [keypoint(n) for n in JOINTS]]
    return {
        **figures.joint_errors(joints, truth, sequence.fps),
        **figures.velocity_score(joints, truth),
        **figures.knee_figures(joints, truth),
        **figures.path_error_share(sequence, truth),
        **figures.floor_figures(sequence),
        **figures.contact_figures(sequence, truth),
        "tilt_deg": figures.tilt_error_deg(sequence, truth),
        "recover_fps": len(sequence) / spent,
    }


def solve_fps() -> float:
    """Return frames a CPU second of `analytic_solve.solve` in batches of 300."""
    rng = np.random.default_rng(0)
    points: Float[np.ndarray, "T 29 3"] = REST_JOINTS + rng.normal(
        scale=0.05, size=(SOLVE_FRAMES, 29, 3)
    )
    turns = np.broadcast_to(prior(), (SOLVE_FRAMES, 23, 2))
    analytic_solve.solve(points, REST_JOINTS[None], turns)
    began = time.process_time()
    for _ in range(SOLVE_BATCHES):
        analytic_solve.solve(points, REST_JOINTS[None], turns)
    return SOLVE_FRAMES * SOLVE_BATCHES / (time.process_time() - began)


def means(rows: list[Row]) -> dict[str, dict[str, figures.Figures]]:
    """Return the group -> row -> mean of each figure over the group's clips that have it."""
    found: dict[str, dict[str, figures.Figures]] = {}
    for group, clips in GROUPS.items():
        chosen = [row["rows"] for row in rows if row["clip"] in clips]
        if len(chosen) == len(clips):
            found[group] = {name: _mean([each[name] for each in chosen]) for name in chosen[0]}
    return found


def _mean(found: list[figures.Figures]) -> figures.Figures:
    keys = [key for key in found[0] if all(key in figure for figure in found)]
    return {key: float(np.mean([figure[key] for figure in found])) for key in keys}


def main(arguments: list[str] | None = None, say: Callable[[str], None] = print) -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--clips", nargs="*", default=[*HELD_OUT, *RENDERED, *REAL])
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the results")
    options = parser.parse_args(arguments)
    rows = [measure(clip) for clip in options.clips]
    result: dict[str, Any] = {
        "clips": rows, "means": means(rows), "tuned": TUNED, "solve_fps": solve_fps(),
        "default": default_row(),
    }  # fmt: skip
    if folder := os.environ.get(PAPER):
        result["official"] = official.compare(Path(folder))
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "mocap.json").write_text(json.dumps(result, indent=1) + "\n")
    text = accuracy_report.markdown(result)
    (options.out / "mocap.md").write_text(text)
    say(text)


if __name__ == "__main__":
    main()
