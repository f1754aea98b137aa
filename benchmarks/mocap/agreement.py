"""Distance of our motion from the official HybrIK's on the same video.

    python -m benchmarks.mocap.agreement VIDEO RES_PK [--hybrik WEIGHTS] [--niki WEIGHTS]

RES_PK is what the official demo writes with `--save-pk` (or NIKI's `vis_tmp.pt`); it is read by a
reader that executes nothing. Rows: the raw landmarks as keypoints, our motion, and with weights our
reading of the network itself. Figures: distance of the 24 joints relative to the pelvis, after ONE
rotation for the clip and no scale; PA-MPJPE of these, and of the twelve joints of the other tables
(bar: 48, never above raw); millimetres, over the frames in which HybrIK found a person.
"""

import argparse
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float
from rich.console import Console
from rich.table import Table

from benchmarks.mocap.truth import JOINTS
from robojackson.body.skeleton import JOINT_NAMES, keypoint
from robojackson.clips.people.dancer import DancerConfig
from robojackson.clips.video import VideoLimits, probe, read_frames
from robojackson.errors import BadTable
from robojackson.formats import hybrik_output
from robojackson.formats.foreign_motion import HybrikMotion
from robojackson.metrics import pose_error
from robojackson.mocap.landmarks.blazepose import repair
from robojackson.mocap.landmarks.landmark_pipeline import detect_landmarks
from robojackson.mocap.networks.network_config import NetworkConfig
from robojackson.mocap.pose.keypoints import build
from robojackson.mocap.recover import MocapConfig, recover_motion
from robojackson.motion.landmark_track import LandmarkTrack

ROOT = (keypoint("pelvis"),)
TWELVE = [keypoint(name) for name in JOINTS]


def agreement(ours: Float[np.ndarray, "T 24 3"], theirs: HybrikMotion) -> dict[str, float]:
    """Return the distances over the frames that both have, millimetres.

    Args:
        ours: Joints of every frame of the video, metres, any fixed axes.
        theirs: HybrIK's; frames without a person are absent.
    Raises:
        BadTable: HybrIK's frames go beyond the video's.
    """
    if theirs.frame.max() >= len(ours):
        raise BadTable(
            f"HybrIK's output has frame {theirs.frame.max()}, the video has {len(ours)} frames: "
            "it was made of another video, or of images at another rate"
        )
    mine, truth = ours[theirs.frame], theirs.points[:, : len(JOINT_NAMES)]
    return {
        "mpjpe_mm": 1e3 * pose_error.rr_mpjpe(mine, truth, ROOT),
        "pa_mpjpe_mm": 1e3 * pose_error.pa_mpjpe(mine, truth),
        "pa_mpjpe_12_mm": 1e3 * pose_error.pa_mpjpe(mine[:, TWELVE], truth[:, TWELVE]),
        "frames": float(len(mine)),
    }


def rows(
    video: Path, track: LandmarkTrack, theirs: HybrikMotion, network: NetworkConfig
) -> Mapping[str, Mapping[str, float]]:
    """Return every row of the table."""
    marks = repair(track)
    raw = build(marks.local, marks.visibility).points[:, : len(JOINT_NAMES)]
    joints = {"raw landmarks": raw, "ours": recover_motion(track, MocapConfig()).joints}
    if network.hybrik:
        from robojackson.mocap.networks.inference import load_networks
        from robojackson.mocap.networks.network_motion import network_motion

        images, nets = read_frames(video), load_networks(network)
        moved = network_motion(track, images, nets, MocapConfig(), network)
        joints["the network, read by us"] = moved.joints
    return {name: agreement(points, theirs) for name, points in joints.items()}


def main() -> None:
    """Measure one video."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("video", type=Path)
    parser.add_argument("res_pk", type=Path)
    parser.add_argument("--size", default="full", help="of the pose model")
    parser.add_argument("--hybrik", help="weights of HybrIK's network")
    parser.add_argument("--niki", help="weights of NIKI")
    given = parser.parse_args()
    theirs = hybrik_output.read(given.res_pk.read_bytes())
    info = probe(given.video, VideoLimits())
    track = detect_landmarks(given.video, info, given.size, DancerConfig())
    network = NetworkConfig(hybrik=given.hybrik, niki=given.niki)
    table = Table("row", "MPJPE mm", "PA-MPJPE mm", "of twelve joints", "frames")
    for name, row in rows(given.video, track, theirs, network).items():
        figures = [f"{row[key]:.1f}" for key in ("mpjpe_mm", "pa_mpjpe_mm", "pa_mpjpe_12_mm")]
        table.add_row(name, *figures, f"{row['frames']:.0f}")
    Console().print(table)


if __name__ == "__main__":
    main()
