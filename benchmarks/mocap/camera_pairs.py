"""Two cameras instead of one: all pairs of the four real cameras.

    python -m benchmarks.mocap.camera_pairs

PA-MPJPE of twelve joints, mm, of the better and the worse camera alone and of both; by how much the
found offset of the clips is wrong (they were started together), and the rays' miss.
"""

from itertools import combinations

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.mocap import figures
from benchmarks.mocap.truth import JOINTS, REAL, load_truth, video_path
from robojackson.body.skeleton import keypoint
from robojackson.clips.people.dancer import DancerConfig
from robojackson.clips.video import VideoLimits, probe
from robojackson.mocap.landmarks.landmark_pipeline import detect_landmarks
from robojackson.mocap.recover import MocapConfig, recover_motion
from robojackson.mocap.views.two_cameras import recover_together
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence


def detected(clip: str) -> LandmarkTrack:
    """Return the landmarks of a bundled clip."""
    path = video_path(clip)
    return detect_landmarks(path, probe(path, VideoLimits()), "full", DancerConfig())


def error_mm(motion: SmplSequence, clip: str) -> float:
    """Return the PA-MPJPE of a motion in the frames of a clip."""
    joints = motion.joints[:, [keypoint(name) for name in JOINTS]]
    return figures.joint_errors(joints, load_truth(clip), motion.fps)["pa_mpjpe_mm"]


def main() -> None:
    """Measure and print."""
    config, tracks = MocapConfig(), {clip: detected(clip) for clip in REAL}
    alone = {clip: error_mm(recover_motion(track, config), clip) for clip, track in tracks.items()}
    table = Table("cameras", "one, better", "one, worse", "both", "what was found")
    errors = []
    for pair in combinations(REAL, 2):
        motion = recover_together(tracks[pair[0]], tracks[pair[1]], config)
        errors.append(error_mm(motion, pair[0]))
        single = sorted(alone[clip] for clip in pair)
        cells = (f"{value:.1f}" for value in (*single, errors[-1]))
        table.add_row(" ".join(clip[-4:] for clip in pair), *cells, motion.notes[-1])
    table.add_row("mean", "", f"{np.mean(list(alone.values())):.1f}", f"{np.mean(errors):.1f}")
    Console(width=160).print(table)


if __name__ == "__main__":
    main()
