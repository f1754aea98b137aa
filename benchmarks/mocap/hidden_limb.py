"""A limb that the detector cannot see: what is made of it (`python -m
benchmarks.mocap.hidden_limb`).

Forty cases of clip, limb, onset and length (0.2 to 1 s), drawn with a seed. In each, the landmarks
of a whole limb are hidden: their visibility is 0 and their places are interpolated in time.
Rows: interpolation (the motion of step 2 with the limb's joints interpolated in time, seen from
the pelvis), step 2 and step 3 on the clip with the hidden limb. Figures: mean distance of the
limb's joints from the truth in the hidden frames, mm, after the similarity that brings the ten
other joints of the frame nearest to the truth, which leaves the limb's own error, and
root-relative after one rotation a clip; and the mean confidence of the joints hidden and seen.
"""

import argparse
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.mocap.truth import (
    HELD_OUT,
    HIPS,
    JOINTS,
    REAL,
    RENDERED,
    Truth,
    load_truth,
    video_path,
)
from robojackson.body.skeleton import keypoint
from robojackson.clips.pose_detector import detect
from robojackson.clips.video import VideoLimits, probe
from robojackson.metrics import pose_error
from robojackson.mocap.landmarks.blazepose import landmark
from robojackson.mocap.recover import MocapConfig, recover_motion
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence

RESULTS = Path(__file__).parents[1] / "results" / "hidden_limb.json"
CASES = 40
SHORTEST_S, LONGEST_S = 0.2, 1.0
MARKS: Mapping[str, tuple[str, ...]] = {
    "arm": ("elbow", "wrist", "pinky", "index", "thumb"),
    "leg": ("knee", "ankle", "heel", "foot_index"),
}
"""Limb -> the landmarks that are hidden."""
ENDS: Mapping[str, tuple[str, ...]] = {"arm": ("elbow", "wrist"), "leg": ("knee", "ankle")}
"""Limb -> the joints that are measured."""


@dataclass(frozen=True)
class Case:
    """One limb of one clip, hidden in the frames from `start` to before `end`."""

    clip: str
    side: str
    limb: str
    start: int
    end: int

    @property
    def joints(self) -> list[str]:
        """Names of the joints that are measured."""
        return [f"{self.side}_{name}" for name in ENDS[self.limb]]


def draw_cases(
    lengths: Mapping[str, tuple[int, float]], count: int, rng: np.random.Generator
) -> list[Case]:
    """Return the cases from clips with so many frames at such a rate; a frame is seen at both
    ends."""
    names = sorted(lengths)
    cases = []
    for _ in range(count):
        clip = names[rng.integers(len(names))]
        frames, fps = lengths[clip]
        longest = min(round(LONGEST_S * fps), frames - 4)
        hidden = int(rng.integers(min(round(SHORTEST_S * fps), longest), longest + 1))
        start = int(rng.integers(2, frames - hidden - 1))
        side, limb = ("left", "right")[rng.integers(2)], ("arm", "leg")[rng.integers(2)]
        cases.append(Case(clip, side, limb, start, start + hidden))
    return cases


def hide(track: LandmarkTrack, case: Case) -> LandmarkTrack:
    """Return the track as if no landmark of the limb were detected."""
    columns = [landmark(f"{case.side}_{name}") for name in MARKS[case.limb]]
    visibility = np.array(track.visibility)
    visibility[case.start : case.end, columns] = 0.0
    return replace(
        track,
        landmarks=bridged(track.landmarks, columns, case.start, case.end),
        world_landmarks=bridged(track.world_landmarks, columns, case.start, case.end),
        visibility=visibility,
    )


def bridged(values: np.ndarray, columns: list[int], start: int, end: int) -> np.ndarray:
    """Return the columns of (T, N, D), linear in time from the frame before `start` to `end`."""
    result = np.array(values)
    share = ((np.arange(start, end) - start + 1) / (end - start + 1))[:, None, None]
    before, after = values[start - 1, columns], values[end, columns]
    result[start:end, columns] = before * (1.0 - share) + after * share
    return result


def figures(case: Case, track: LandmarkTrack, truth: Truth, whole: MocapConfig) -> dict[str, float]:
    """Return the errors of all rows in mm, and confidences."""
    plain = replace(whole, temporal=replace(whole.temporal, enabled=False))
    hidden = hide(track, case)
    seen, step_2, step_3 = (
        recover_motion(track, plain),
        recover_motion(hidden, plain),
        recover_motion(hidden, whole),
    )
    joints = placed(seen)
    columns = [JOINTS.index(name) for name in case.joints]
    bridge = bridged(joints, columns, case.start, case.end)
    keys = [keypoint(name) for name in case.joints]
    span = slice(case.start, case.end)
    rows = {
        "interpolation": bridge, "step_2": placed(step_2), "step_3": placed(step_3), "seen": joints
    }  # fmt: skip
    return {
        **{f"{name}_mm": limb_error(row, truth, case) for name, row in rows.items()},
        **{f"{name}_rr_mm": error(row, truth, case) for name, row in rows.items()},
        "confidence_hidden": float(step_3.confidence[span][:, keys].mean()),
        "confidence_seen": float(recover_motion(track, whole).confidence[span][:, keys].mean()),
    }


def placed(sequence: SmplSequence) -> np.ndarray:
    """Return the twelve joints seen from the hips' middle."""
    joints = sequence.joints[:, [keypoint(name) for name in JOINTS]]
    return pose_error.root_relative(joints, HIPS)


def limb_error(joints: np.ndarray, truth: Truth, case: Case) -> float:
    """Return the error of the limb's joints in the hidden frames, the other ten joints aligned to
    the truth, mm."""
    columns = [JOINTS.index(name) for name in case.joints]
    others = np.setdiff1d(np.arange(len(JOINTS)), columns)
    mine, right = (x[case.start : min(case.end, len(truth.joints))] for x in (joints, truth.joints))
    moved = pose_error.procrustes(mine[:, others], right[:, others])(mine)
    return 1e3 * float(np.linalg.norm(moved - right, axis=-1)[:, columns].mean())


def error(joints: np.ndarray, truth: Truth, case: Case) -> float:
    """Return the error of the limb's joints in the hidden frames, mm."""
    count = min(len(joints), len(truth.joints))
    aligned = pose_error.align_clip(joints[:count], truth.joints[:count], HIPS)
    goal = pose_error.root_relative(truth.joints[:count], HIPS)
    columns = [JOINTS.index(name) for name in case.joints]
    off = np.linalg.norm(aligned - goal, axis=-1)[case.start : case.end, columns]
    return 1e3 * float(off.mean())


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--clips", nargs="*", default=[*RENDERED[1:], *REAL, *HELD_OUT])
    parser.add_argument("--cases", type=int, default=CASES)
    parser.add_argument("--seed", type=int, default=4)
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args()
    tracks = {}
    for clip in options.clips:
        path = video_path(clip)
        tracks[clip] = detect(path, probe(path, VideoLimits()), "full")
    lengths = {clip: (len(track), track.fps) for clip, track in tracks.items()}
    cases = draw_cases(lengths, options.cases, np.random.default_rng(options.seed))
    rows = [
        vars(case) | figures(case, tracks[case.clip], load_truth(case.clip), MocapConfig())
        for case in cases
    ]
    result = {"means": means(rows), "rows": rows, "seed": options.seed, "what": __doc__}
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps(result, indent=1) + "\n")
    show = Table("figure", "mean", title=f"{len(rows)} hidden limbs")
    for name, value in result["means"].items():
        show.add_row(name, f"{value:.3g}")
    Console().print(show)


def means(rows: list[dict[str, float]]) -> dict[str, float]:
    """Return the mean of each figure, and how far step 3 is under interpolation."""
    names = [name for name in rows[0] if name.endswith("_mm") or name.startswith("confidence")]
    found = {name: float(np.mean([row[name] for row in rows])) for name in names}
    found["step_3_over_interpolation"] = found["step_3_mm"] / found["interpolation_mm"] - 1.0
    return found


if __name__ == "__main__":
    main()
