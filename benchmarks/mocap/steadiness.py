"""What a motion must not depend on: checks of motion capture that need no truth.

    python -m benchmarks.mocap.steadiness VIDEO...

Rows: the clip in a mirror (the mirrored motion is expected), thinned to 10 frames a second, at half
its size, and encoded again at a third of its quality. Figure: mean distance of the twelve joints
from those of the clip itself, root-relative after ONE rotation for the clip, millimetres.
"""

import argparse
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
from jaxtyping import Float
from rich.console import Console
from rich.table import Table

from benchmarks.mocap.truth import HIPS, JOINTS
from robojackson.body.skeleton import keypoint
from robojackson.clips.people.dancer import DancerConfig
from robojackson.clips.video import VideoLimits, probe, timed_frames
from robojackson.metrics import pose_error
from robojackson.mocap.landmarks.landmark_pipeline import detect_landmarks
from robojackson.mocap.recover import MocapConfig, recover_motion
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence

SLOW_FPS = 10.0
FINE, COARSE = 16, 34
"""Constant rate factors of H.264."""
MIRROR = np.array([index + 1 - 2 * (index % 2) for index in range(len(JOINTS))])
"""The same joint on the other side."""
Edit = Callable[[np.ndarray], np.ndarray]


def joints(sequence: SmplSequence) -> Float[np.ndarray, "T 12 3"]:
    """Return the twelve joints, metres."""
    return sequence.joints[:, [keypoint(name) for name in JOINTS]]


def apart_mm(one: Float[np.ndarray, "T 12 3"], other: Float[np.ndarray, "T 12 3"]) -> float:
    """Return the mean distance after one rotation for the clip, root-relative."""
    count = min(len(one), len(other))
    return 1e3 * pose_error.rr_mpjpe(one[:count], other[:count], HIPS)


def measure(video: Path) -> dict[str, float]:
    """Return all rows of one clip."""
    info, config = probe(video, VideoLimits()), MocapConfig()
    track = detect_landmarks(video, info, "full", DancerConfig())
    plain = joints(recover_motion(track, config))
    stride = max(round(track.fps / SLOW_FPS), 1)
    slow = joints(recover_motion(thinned(track, stride), config))
    found = {"10 frames a second": apart_mm(slow, plain[::stride])}
    edits: dict[str, tuple[Edit, int]] = {
        "mirror": (lambda image: image[:, ::-1], FINE),
        "half size": (lambda image: cv2.resize(image, None, fx=0.5, fy=0.5), FINE),
        "encoded again": (lambda image: image, COARSE),
    }
    for name, (edit, quality) in edits.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "clip.mp4"
            write(path, (edit(image) for _, image in timed_frames(video)), info.fps, quality)
            other = detect_landmarks(path, probe(path, VideoLimits()), "full", DancerConfig())
        motion = joints(recover_motion(other, config))
        if name == "mirror":
            motion = motion[:, MIRROR] * [1.0, -1.0, 1.0]
        found[name] = apart_mm(motion, plain)
    return found


def thinned(track: LandmarkTrack, stride: int) -> LandmarkTrack:
    """Return each n-th frame."""
    return replace(
        track,
        fps=track.fps / stride,
        landmarks=track.landmarks[::stride],
        world_landmarks=track.world_landmarks[::stride],
        visibility=track.visibility[::stride],
        time_s=None if track.time_s is None else track.time_s[::stride],
        to_first=None if track.to_first is None else track.to_first[::stride],
    )


def write(path: Path, images: Iterator[np.ndarray], fps: float, quality: int) -> None:
    """Write RGB images as H.264."""
    with av.open(str(path), "w") as container:
        stream = None
        for image in images:
            even = image[: image.shape[0] // 2 * 2, : image.shape[1] // 2 * 2]
            if stream is None:
                rate = Fraction(fps).limit_denominator(1001)
                stream = container.add_stream("libx264", rate=rate, options={"crf": str(quality)})
                stream.height, stream.width, stream.pix_fmt = *even.shape[:2], "yuv420p"
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(even), format="rgb24")
            container.mux(stream.encode(frame))
        if stream is not None:
            container.mux(stream.encode())


def main() -> None:
    """Measure videos."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("videos", type=Path, nargs="+")
    table = Table("clip, mm", "mirror", "10 frames a second", "half size", "encoded again")
    for video in parser.parse_args().videos:
        found = measure(video)
        row = [f"{found[str(column.header)]:.0f}" for column in table.columns[1:]]
        table.add_row(video.stem, *row)
    Console().print(table)


if __name__ == "__main__":
    main()
