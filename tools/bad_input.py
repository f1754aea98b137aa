"""What `robojackson mocap` makes of clips that are hard or bad: a table, and a picture of each.

    python -m tools.bad_input FOLDER                       # all: make the clips, run, tell
    python -m tools.bad_input FOLDER --only lying returns  # some

`docs/bad_input.md` has the outcome. A motion comes with its confidence and its notes, or the input
is refused with one line. A picture has three frames: the landmarks over the video, and the motion.
"""

import argparse
import json
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from robojackson.clips.track import LandmarkTrack
from robojackson.mocap.skeleton import KEYPOINT_NAMES
from robojackson.motion.smpl import SmplSequence
from robojackson.report import canvas
from robojackson.report.skeleton_panel import skeleton_panel, view_of
from robojackson.report.source_panel import source_panels
from storage import tables
from tools.bad_clips import KINDS

LEGS = [i for i, name in enumerate(KEYPOINT_NAMES) if name.endswith(("knee", "ankle"))]
ARMS = [i for i, name in enumerate(KEYPOINT_NAMES) if name.endswith(("elbow", "wrist"))]
SHOTS = (0.15, 0.5, 0.85)
WIDTH, HEIGHT = 200, 260


def try_one(name: str, folder: Path) -> dict[str, Any]:
    """The answer of the command to one clip: figures, or `refused` with its line."""
    video, out = folder / f"{name}.mp4", folder / name
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, "-m", "flows.cli", "mocap", str(video), "-o", str(out), "--json"],
        capture_output=True,
        text=True,
        check=False,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cost = {
        "cpu_s": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
        "peak_mb": after.ru_maxrss / 1024,
    }
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if line.startswith("robojackson")]
        return {"clip": name, "refused": " / ".join(lines) or done.stderr[-300:], **cost}
    answer = json.loads(done.stdout)
    motion = tables.decode(SmplSequence, (out / "smpl.parquet").read_bytes(), name)
    confidence = {
        part: float(motion.confidence[:, points].mean())
        for part, points in (("all", slice(None)), ("legs", LEGS), ("arms", ARMS))
    }
    figures = {key: answer[key] for key in ("frames", "fps", "detected", "notes")}
    return {"clip": name, **figures, "confidence": confidence, **cost}


def picture(name: str, folder: Path) -> np.ndarray:
    """Three frames: the landmarks over the video above, the motion below."""
    out = folder / name
    track = tables.decode(LandmarkTrack, (out / "landmarks.parquet").read_bytes(), name)
    motion = tables.decode(SmplSequence, (out / "smpl.parquet").read_bytes(), name)
    frames = np.array([int(share * (len(motion) - 1)) for share in SHOTS])
    above = source_panels(folder / f"{name}.mp4", track, frames, WIDTH, HEIGHT)
    below = [
        skeleton_panel(
            motion, frame, view_of(motion.keypoints_w[frame, 0, :2], 0.0, WIDTH, HEIGHT),
            WIDTH, HEIGHT,
        )
        for frame in frames
    ]  # fmt: skip
    rows = [np.concatenate([above[int(f)] for f in frames], 1), np.concatenate(below, 1)]
    sheet = np.concatenate(rows, 0)
    canvas.label(sheet, name, "")
    return sheet


def row(told: dict[str, Any]) -> str:
    """A row of the table in Markdown."""
    cost = f"{told['cpu_s']:.0f} s, {told['peak_mb']:.0f} MB"
    if "refused" in told:
        return f"| {told['clip']} | - | - | - | {cost} | refused: {told['refused']} |"
    seen = f"{told['detected']} of {told['frames']}, {told['fps']:.4g} fps"
    sure = told["confidence"]
    parts = f"{sure['all']:.2f} | {sure['legs']:.2f} / {sure['arms']:.2f}"
    return f"| {told['clip']} | {seen} | {parts} | {cost} | {'; '.join(told['notes']) or '-'} |"


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="*", choices=list(KINDS), default=list(KINDS))
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    print(
        "| clip | person in | confidence | legs / arms | cost | notes |\n|---|---|---|---|---|---|"
    )
    make = [sys.executable, "-m", "tools.bad_clips", str(options.folder), *options.only]
    subprocess.run(make, check=True)  # elsewhere: a child's peak memory begins with its parent's
    for name in options.only:
        told = try_one(name, options.folder)
        print(row(told), flush=True)
        if "refused" not in told:
            sheet = picture(name, options.folder)
            cv2.imwrite(str(options.folder / f"{name}.png"), sheet[..., ::-1])


if __name__ == "__main__":
    main()
