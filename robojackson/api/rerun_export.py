"""A run as a recording of Rerun (.rrd): video, landmarks, skeleton, robot, contacts and errors."""

from pathlib import Path

import numpy as np

from robojackson.api.arguments import robot_of
from robojackson.body.skeleton import KEYPOINT_NAMES, PARENTS
from robojackson.errors import MissingDependency
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.rollout import Rollout
from robojackson.motion.smpl_sequence import CONTACT_POINTS, SmplSequence
from robojackson.report.web.player_data import Player, player
from robojackson.report.web.shapes import body_poses

FPS, MOST_S = 30.0, 60.0


def write_rerun(folder: Path, out: Path) -> Path:
    """Write the recording of the folder of a run.

    Raises:
        MissingDependency: rerun-sdk is not installed.
        StoreError: a table of the run is missing.
    """
    try:
        import rerun as rr
    except ImportError as cause:
        raise MissingDependency("pip install 'robojackson[rerun]' writes .rrd files") from cause
    track = LandmarkTrack.load(folder / "landmarks.parquet")
    sequence = SmplSequence.load(folder / "smpl.parquet")
    reference = ReferenceMotion.load(folder / "reference.parquet")
    rollout = Rollout.load(folder / "rollout.parquet").qpos
    robot = robot_of(reference)
    shown = player(track, sequence, reference, rollout, robot, FPS, MOST_S)
    recording = rr.RecordingStream("robojackson")
    recording.save(str(out))
    film = folder / "dance.mp4"
    if film.is_file():
        video = rr.AssetVideo(path=film)
        recording.log("video", video, static=True)
        times = video.read_frame_timestamps_nanos()
        stamps = rr.VideoFrameReference.columns_nanos(times)
        recording.send_columns("video", [rr.TimeColumn("time", duration=1e-9 * times)], stamps)
    for index, seconds in enumerate(shown.when.time_s):
        recording.set_time("time", duration=float(seconds))
        _log_moment(recording, shown, track, sequence, index)
    chosen = rollout[shown.when.rollout]
    poses, _ = body_poses(robot.model, chosen)
    _log_robot(recording, robot.body_names, poses[:, 1:, :3], shown.when.time_s)
    recording.disconnect()
    return out


def _log_moment(
    recording: "rr.RecordingStream",  # type: ignore[name-defined]  # noqa: F821
    shown: Player, track: LandmarkTrack, sequence: SmplSequence, index: int,
) -> None:  # fmt: skip
    import rerun as rr

    frame = min(int(shown.when.frame[index]), len(sequence) - 1)
    points = np.asarray(sequence.keypoints_w[frame], float)
    bones = [[points[p], points[c]] for c, p in enumerate(PARENTS) if p >= 0]
    recording.log("person/bones", rr.LineStrips3D(bones, radii=0.015))
    recording.log("person/keypoints", rr.Points3D(points, labels=list(KEYPOINT_NAMES), radii=0.02))
    row = track.nearest(frame / track.fps)
    image = np.asarray(track.landmarks[row, :, :2]) * [track.width, track.height]
    recording.log("landmarks", rr.Points2D(image[np.isfinite(image).all(1)]))
    for name, state in zip(CONTACT_POINTS, sequence.contact[frame], strict=True):
        recording.log(f"contacts/{name}", rr.Scalars(float(state)))
    for name, apart in shown.error_m.items():
        recording.log(f"errors/{name}", rr.Scalars(1000 * float(apart[index])))


def _log_robot(
    recording: "rr.RecordingStream",  # type: ignore[name-defined]  # noqa: F821
    names: tuple[str, ...], places: np.ndarray, times: np.ndarray,
) -> None:  # fmt: skip
    import rerun as rr

    for place, seconds in zip(places, times, strict=True):
        recording.set_time("time", duration=float(seconds))
        recording.log("robot", rr.Points3D(place, labels=list(names), radii=0.03))
