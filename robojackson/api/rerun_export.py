"""A run as a recording of Rerun (.rrd): video, landmarks, skeleton, robot, contacts, rewards."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from robojackson.api.run_folder import FILMS, RunFolder, one_of, read_run
from robojackson.body.skeleton import KEYPOINT_NAMES, PARENTS
from robojackson.errors import MissingDependency
from robojackson.files.file_tree import FileTree
from robojackson.formats.gltf_robot import body_parts
from robojackson.motion.smpl_sequence import CONTACT_POINTS
from robojackson.report.web.shapes import body_poses
from robojackson.rl.config.train_config import ControlConfig, TrackConfig
from robojackson.rl.evaluation.reward_meter import RewardMeter
from robojackson.rl.evaluation.rollouts import Moment
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation

if TYPE_CHECKING:
    from rerun import RecordingStream

REWARD = "reward_"


def write_rerun(folder: Path, out: Path) -> Path:
    """Write the recording of the folder of a run.

    Raises:
        MissingDependency: rerun-sdk is not installed.
        StoreError: a table of the run is missing, or the file cannot be written.
    """
    try:
        import rerun as rr
    except ImportError as cause:
        raise MissingDependency("pip install 'robojackson[rerun]' writes .rrd files") from cause
    run, film = read_run(folder), one_of(folder, FILMS)
    with tempfile.TemporaryDirectory(prefix="robojackson-") as folder_of_result:
        made = Path(folder_of_result) / "run.rrd"
        recording = rr.RecordingStream("robojackson")
        recording.save(str(made))
        recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        video = rr.AssetVideo(path=film)
        recording.log("video", video, static=True)
        times = video.read_frame_timestamps_nanos()
        stamps = rr.VideoFrameReference.columns_nanos(times)
        recording.send_columns("video", [rr.TimeColumn("time", duration=1e-9 * times)], stamps)
        _log_person(recording, run)
        _log_robot(recording, run)
        _log_rewards(recording, run)
        recording.disconnect()
        FileTree(out.parent).write(out.name, made)
    return out


def _log_person(recording: "RecordingStream", run: RunFolder) -> None:
    """Log landmarks in the picture, skeleton in the world, contacts and errors."""
    import rerun as rr

    shown, sequence, track = run.shown, run.sequence, run.track
    for index, seconds in enumerate(shown.when.time_s):
        recording.set_time("time", duration=float(seconds))
        frame = min(int(shown.when.frame[index]), len(sequence) - 1)
        points = np.asarray(sequence.keypoints_w[frame], float)
        bones = [[points[p], points[c]] for c, p in enumerate(PARENTS) if p >= 0]
        recording.log("person/bones", rr.LineStrips3D(bones, radii=0.015))
        labels = list(KEYPOINT_NAMES)
        recording.log("person/keypoints", rr.Points3D(points, labels=labels, radii=0.02))
        row = track.nearest(frame / track.fps)
        image = np.asarray(track.landmarks[row, :, :2]) * [track.width, track.height]
        recording.log("landmarks", rr.Points2D(image[np.isfinite(image).all(1)]))
        for name, state in zip(CONTACT_POINTS, sequence.contact[frame], strict=True):
            recording.log(f"contacts/{name}", rr.Scalars(float(state)))
        for name, apart in shown.error_m.items():
            recording.log(f"errors/{name}", rr.Scalars(1000 * float(apart[index])))


def _log_robot(recording: "RecordingStream", run: RunFolder) -> None:
    """Log the parts of the robot's bodies once, and the bodies' poses at every moment."""
    import rerun as rr

    model, when = run.robot.model, run.shown.when
    poses, _ = body_poses(model, run.rollout[when.rollout])
    seconds = rr.TimeColumn("time", duration=when.time_s)
    for body, parts in body_parts(model).items():
        path = f"robot/{model.body(body).name}"
        for index, (surface, rgb) in enumerate(parts):
            mesh = rr.Mesh3D(
                vertex_positions=surface.vertices, vertex_normals=surface.normals,
                triangle_indices=surface.faces, albedo_factor=[*rgb, 1.0],
            )  # fmt: skip
            recording.log(f"{path}/{index}", mesh, static=True)
        moved = rr.Transform3D.columns(
            translation=poses[:, body, :3], quaternion=poses[:, body, [4, 5, 6, 3]]
        )
        recording.send_columns(path, [seconds], moved)


def _log_rewards(recording: "RecordingStream", run: RunFolder) -> None:
    """Log what every control step earns by the reward of a training from scratch."""
    import rerun as rr

    seconds = rr.TimeColumn("time", duration=np.arange(len(run.rollout)) * run.reference.dt)
    for name, values in rewards(run).items():
        recording.send_columns(f"rewards/{name}", [seconds], rr.Scalars.columns(scalars=values))


def rewards(run: RunFolder) -> dict[str, np.ndarray]:
    """Return the terms of the reward at every control step of what was danced.

    The action is not recorded, so that the term that pays for a steady one is left out.
    """
    qpos, count, clip = run.rollout, len(run.rollout), Clip(run.reference)
    sim = Simulation(run.robot, ControlConfig(), count)
    sim.place(np.arange(count), qpos, _velocities(run))
    before = np.roll(sim.points, 1, axis=0)
    before[0] = sim.points[0]
    meter = RewardMeter(run.robot, run.reference, clip, TrackConfig())
    at, still = clip.at(np.arange(count)), np.zeros(count)
    found = meter(Moment(sim, at, before, still, np.zeros(count, bool)))
    sim.close()
    return {
        name.removeprefix(REWARD): values
        for name, values in found.items()
        if name.startswith(REWARD) and name != f"{REWARD}action_rate"
    } | {"sum": found["return_own"]}


def _velocities(run: RunFolder) -> np.ndarray:
    """Return the velocities from one control step to the next."""
    qpos, model = run.rollout, run.robot.model
    found = np.zeros((len(qpos), model.nv))
    for step in range(1, len(qpos)):
        mujoco.mj_differentiatePos(model, found[step], run.reference.dt, qpos[step - 1], qpos[step])
    return found
