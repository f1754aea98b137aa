"""Which stage of motion capture costs what, by group of joints and frame rate; is its spread right.

    python -m benchmarks.mocap.breakdown [CLIP...] [--tracks FOLDER]

PA-MPJPE of twelve joints, mm, after each stage, on bundled clips (default: those that nothing was
tuned on, and the real ones) as they are and thinned to 10 frames a second. Worst second: by how
much the stage worsens one. Spread: share of errors within one spread of the network (.68 where it
is right) and rank correlation of both, seen from the hips. FOLDER keeps CLIP.parquet files.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from rich.console import Console
from rich.table import Table
from scipy.stats import spearmanr

from benchmarks.mocap.camera_pairs import detected
from benchmarks.mocap.steadiness import SLOW_FPS, thinned
from benchmarks.mocap.truth import HELD_OUT, JOINTS, REAL, Truth, load_truth
from robojackson.body.skeleton import keypoint
from robojackson.body.smoothing import lowpass
from robojackson.clips.quality.visibility import weigh_visibility
from robojackson.metrics.pose_error import procrustes
from robojackson.mocap.grounding.up_direction import known_up
from robojackson.mocap.landmarks.blazepose import BODY, LANDMARK_NAMES, fill_gaps, landmark, repair
from robojackson.mocap.landmarks.bone_lengths import fit_skeleton
from robojackson.mocap.landmarks.pinhole_camera import place
from robojackson.mocap.landmarks.refinement import refine
from robojackson.mocap.recover import MocapConfig, recover_motion, view_track
from robojackson.mocap.temporal.temporal_lift import depth_sd, lift
from robojackson.motion.landmark_track import LandmarkTrack, evenly

MARKS = [landmark(name) for name in JOINTS]
GROUPS = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
GROUP_OF = np.array([name.split("_")[1] for name in JOINTS])
IN_BODY = [[LANDMARK_NAMES[index] for index in BODY].index(name) for name in JOINTS]
Stages = dict[str, np.ndarray]


def stages(track: LandmarkTrack, config: MocapConfig) -> tuple[Stages, Float[np.ndarray, "T 12 2"]]:
    """Return the twelve joints after each stage, and the network's standard deviations."""
    track = evenly(track)
    found = {"raw": fill_gaps(track.world_landmarks, track.detected)[:, MARKS]}
    seen = evenly(weigh_visibility(track))
    marks = repair(seen)
    found["repair"] = marks.local[:, MARKS]
    view = view_track(track, config)
    placed = place(marks, view.pinhole, track.fps, config.depth_cutoff_hz)
    found["before the camera"] = placed[:, MARKS]
    known = known_up(view.scene, config.gravity)
    lifted = lift(placed, marks.local, marks.visibility, track.fps, config.temporal, known)
    found["network"] = lifted.points[:, MARKS]
    depth_m = lifted.depth_sd(config.temporal.depth_floor_m)
    for name, start, depth in (
        ("refined without network", placed, None),
        ("refined", lifted.points, depth_m),
    ):
        rest = fit_skeleton(start, config.bone_trust)
        refined = refine(start, marks.visibility, rest, track.fps, config.refine, depth)
        found[name] = refined[:, MARKS]
    found["low-pass"] = lowpass(refined, track.fps, config.cutoff_hz)[:, MARKS]
    motion = recover_motion(track, config)
    found["solved, on the floor"] = motion.joints[:, [keypoint(name) for name in JOINTS]]
    spread = np.stack([1.25 * lifted.spread[..., 0], depth_sd(lifted.spread, 0.0)], -1)
    return found, spread[:, IN_BODY]


def errors(joints: np.ndarray, truth: Truth) -> Float[np.ndarray, "T 12"]:
    """Return the distance of each joint after a Procrustes fit a frame, mm."""
    count = min(len(joints), len(truth.joints))
    mine, goal = joints[:count], truth.joints[:count]
    return np.asarray(1e3 * np.linalg.norm(procrustes(mine, goal)(mine) - goal, axis=-1))


def worst_second(before: np.ndarray, after: np.ndarray, fps: float) -> float:
    """Return by how much the worst second of a clip became worse, mm."""
    change = (after - before).mean(1)
    width = min(max(round(fps), 1), len(change))
    return float(np.convolve(change, np.ones(width) / width, "valid").max())


def off_axis(joints: np.ndarray, truth: Truth) -> Float[np.ndarray, "T 12 3"]:
    """Return errors in camera axes, seen from the hips, the truth laid over each frame, metres."""
    count = min(len(joints), len(truth.joints))
    mine, goal = joints[:count], truth.joints[:count]
    laid = procrustes(goal, mine)(goal)
    laid, mine = (points - points[:, :2].mean(1, keepdims=True) for points in (laid, mine))
    return np.asarray(np.abs(laid - mine))


def clips(names: list[str], folder: Path | None) -> Iterator[tuple[str, LandmarkTrack, Truth]]:
    """Yield clips with their truth, also thinned."""
    for name in names:
        kept = folder / f"{name}.parquet" if folder else None
        track = LandmarkTrack.load(kept) if kept and kept.is_file() else detected(name)
        truth = load_truth(name)
        yield name, track, truth
        stride = round(track.fps / SLOW_FPS)
        slow = replace(truth, joints=truth.joints[::stride], feet=None)
        yield f"{name} at {SLOW_FPS:g}", thinned(track, stride), slow


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("clips", nargs="*", default=[*HELD_OUT, *REAL])
    parser.add_argument("--tracks", type=Path)
    options = parser.parse_args()
    config, rows = MocapConfig(), []
    for name, track, truth in clips(options.clips, options.tracks):
        found, spread = stages(track, config)
        off = {stage: errors(joints, truth) for stage, joints in found.items()}
        axes = off_axis(found["network"], truth)
        rows.append((name, track.fps, off, axes, spread[: len(axes)]))
    console = Console(width=150)
    for title, chosen in (
        ("real", [r for r in rows if r[0].startswith("person")]),
        ("rendered", [r for r in rows if not r[0].startswith("person")]),
    ):
        for slow in (False, True):
            group = [row for row in chosen if row[0].endswith(f" at {SLOW_FPS:g}") == slow]
            if group:
                console.print(_stage_table(f"{title}, {'10' if slow else 'all'} fps", group))
        if chosen:
            console.print(_spread_table(title, chosen))


def _stage_table(title: str, rows: list) -> Table:  # type: ignore[type-arg]
    table = Table("stage", "all", *GROUPS, "worst clip", "worst second", title=title)
    before = None
    for stage in rows[0][2]:
        mean = np.mean([row[2][stage].mean(0) for row in rows], 0)
        cells = [f"{mean.mean():.1f}", *(f"{mean[g == GROUP_OF].mean():.0f}" for g in GROUPS)]
        start = {"refined without network": "before the camera", "refined": "network"}
        base = start.get(stage, before)
        if base:
            change = max(row[2][stage].mean() - row[2][base].mean() for row in rows)
            window = max(worst_second(row[2][base], row[2][stage], row[1]) for row in rows)
            cells += [f"{change:+.1f}", f"{window:+.0f}"]
        table.add_row(stage, *cells)
        before = stage if stage != "refined without network" else before
    return table


def _spread_table(title: str, rows: list) -> Table:  # type: ignore[type-arg]
    off, spread = (np.concatenate([row[k] for row in rows]) for k in (3, 4))
    table = Table("spread", "across: within", "rank", "depth: within", "rank", title=title)
    for group in (*GROUPS, "all"):
        which = group == GROUP_OF if group != "all" else np.ones(len(JOINTS), bool)
        across, depth = off[:, which, :2], off[:, which, 2]
        result = spread[:, which]
        cells = []
        for error, own in ((across.mean(-1), result[..., 0]), (depth, result[..., 1])):
            axes = across if error is not depth else depth[..., None]
            cells.append(f"{np.mean(axes < own[..., None]):.2f}")
            cells.append(f"{spearmanr(error.ravel(), own.ravel())[0]:.2f}")
        table.add_row(group, *cells)
    return table


if __name__ == "__main__":
    main()
