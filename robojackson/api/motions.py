"""Human and robot motions: recovered from a person, fitted to a robot, read and written."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from robojackson.api.arguments import (
    FilePath,
    Progress,
    RobotLike,
    counter,
    path_of,
    read_if_path,
    require_robot,
    robot_of,
)
from robojackson.api.foreign_files import Up, format_of, holds_a_person, read_foreign
from robojackson.api.robots import load_robot
from robojackson.api.second_camera import recover_with_second
from robojackson.api.videos import detect_landmarks
from robojackson.clips.video import read_frames
from robojackson.errors import BadConfiguration, BadTable, StoreError
from robojackson.files.file_tree import FileTree
from robojackson.formats import registry
from robojackson.formats.foreign_motion import require_person
from robojackson.mocap import recover
from robojackson.mocap.landmarks.landmark_pipeline import Quality
from robojackson.mocap.networks.network_config import NetworkConfig
from robojackson.mocap.recover import MocapConfig
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.retarget import retargeting
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.robot.model import Robot

if TYPE_CHECKING:
    from robojackson.mocap.networks.inference import Networks

TABLE = ".parquet"
OF_STAGES = (TABLE, ".safetensors")
"""Suffixes of what stages write, and no exporter."""
MOST_FRAMES, MOST_STEPS = 20_000, 50_000
"""Of a motion that is fitted to a robot: eleven minutes at 30 frames a second, and at 15 ms a
control step."""


@dataclass(frozen=True)
class LoadedNetworks:
    """The published networks with weights of the user: their configuration and modules."""

    config: NetworkConfig
    networks: "Networks"


def recover_motion(
    source: FilePath | LandmarkTrack,
    *,
    second: FilePath | LandmarkTrack | None = None,
    quality: Quality = "full",
    person: int | None = None,
    config: MocapConfig | None = None,
    networks: NetworkConfig | LoadedNetworks | None = None,
    video: FilePath | None = None,
    progress: Progress = False,
) -> SmplSequence:
    """Recover the motion of a person, in metres, standing on the floor.

    Args:
        source: A video, a landmarks.parquet, or the landmarks themselves.
        second: The same dance from another camera, likewise; neither camera may move.
        quality: Pose model for a video; see `detect_landmarks`.
        person: Number of the person to follow in a video; see `detect_landmarks`.
        config: How landmarks become a motion.
        networks: Weights of HybrIK, and NIKI, that take the place of our own network; what
            `load_weights` returned, or their paths.
        video: The file of the landmarks, which HybrIK looks at; a video as source is its own.
        progress: True shows a bar; a function is called with (frames done, frames in all).

    Returns:
        SMPL parameters, axis-angle (T, 24 * 3), and 29 keypoints (T, 29, 3), metres, world frame
        (x forward, y left, z up, floor at 0), at even frames.

    Raises:
        UnreadableVideo, TruncatedVideo, VideoTooLong: see `probe_video`.
        NoPersonFound, TrackTooShort: no person is detected for long enough.
        BadWeights: a file of weights cannot be used.
        BadConfiguration: HybrIK without a video, or with two.
        ViewsDisagree: the two clips do not show the same dance.
    """
    motion = config or MocapConfig()
    if isinstance(source, LandmarkTrack) or path_of(source, "the video").suffix == TABLE:
        track = read_if_path(LandmarkTrack, source)
    else:
        video = video or source
        track = detect_landmarks(source, quality=quality, person=person, progress=progress)
    loaded = load_weights(networks) if isinstance(networks, NetworkConfig) else networks
    if second is not None:
        if loaded is not None:
            raise BadConfiguration("HybrIK reads one camera: omit the second clip")
        return recover_with_second(track, video, second, motion, quality, person, progress)
    if loaded is None:
        return recover.recover_motion(track, motion)
    if video is None:
        raise BadConfiguration("HybrIK's network looks at the video: give video=, too")
    from robojackson.mocap.networks.network_motion import network_motion

    with counter(progress, f"networks on {Path(video).name}") as count:
        images = read_frames(Path(video))
        return network_motion(track, images, loaded.networks, motion, loaded.config, count)


def load_weights(config: NetworkConfig) -> LoadedNetworks | None:
    """Load HybrIK's and NIKI's weights; None where none are named.

    Raises:
        BadWeights: a file cannot be used.
    """
    if not config.hybrik:
        return None
    from robojackson.mocap.networks.inference import load_networks

    return LoadedNetworks(config, load_networks(config))


def retarget_motion(
    motion: FilePath | SmplSequence,
    robot: RobotLike = "humanoid",
    *,
    config: RetargetConfig | None = None,
) -> ReferenceMotion:
    """Fit a human motion to a robot: every frame solved together, checked against its motors.

    Args:
        motion: What `recover_motion` or `read_motion` returned, or a file that they read.
        robot: Name, YAML file, or what `load_robot` returned.
        config: Method, weights, tempo and repair.

    Returns:
        MuJoCo positions (S, nq) and velocities (S, nv) at the robot's control step, metres and
        radians. `scorecard` holds its quality: training refuses figures over a bar.

    Raises:
        TrackTooShort: too few frames.
        UnknownName, BadConfiguration: no such robot, or a wrong description of it.
    """
    sequence = motion if isinstance(motion, SmplSequence) else read_motion(motion)
    if not isinstance(sequence, SmplSequence):
        raise BadConfiguration(f"{motion}: a motion of robot {sequence.robot!r} already")
    machine = load_robot(robot)
    seconds, most_s = len(sequence) / sequence.fps, MOST_STEPS * machine.description.control_dt
    if len(sequence) > MOST_FRAMES or seconds > most_s:
        raise BadTable(
            f"{len(sequence):,} frames, {seconds:,.0f} s; at most {MOST_FRAMES:,} frames and "
            f"{most_s:,.0f} s are fitted together: cut the motion"
        )
    require_person(sequence.keypoints_w, "the motion")
    reference = retargeting.retarget_motion(sequence, machine, config or RetargetConfig())
    return replace(reference, robot_file=machine.description.file)


def read_motion(
    file: FilePath,
    *,
    fps: float | None = None,
    up: Up | None = None,
    config: MocapConfig | None = None,
) -> SmplSequence | ReferenceMotion:
    """Read a motion: our Parquet tables, or a human motion of another project.

    Args:
        file: smpl.parquet, reference.parquet, or a file of HybrIK, NIKI, AMASS, AIST++, GVHMR, BVH
            or our csv, recognised by its content. Nothing in it is executed.
        fps: Frames a second, where the file does not give them; not for our tables.
        up: Axis that points up, where it is unusual; not for our tables.
        config: Configuration of the camera and the floor of HybrIK's files.

    Returns:
        A human motion put on the floor, or a robot's reference motion.

    Raises:
        StoreError: no such file.
        UnknownName, BadTable: no known format, or a damaged file.
        BadConfiguration: no frame rate, or one that no motion has; `fps` or `up` for our table.
    """
    path = path_of(file, "the motion")
    if path.suffix == TABLE:
        if fps is not None or up is not None:
            raise BadConfiguration(f"{path}: our tables have their own fps and axes; drop both")
        return SmplSequence.load(path) if holds_a_person(path) else ReferenceMotion.load(path)
    return read_foreign(path, fps, up, config or MocapConfig()).motion


def write_motion(
    motion: FilePath | SmplSequence | ReferenceMotion,
    file: FilePath,
    to: str | None = None,
    robot: RobotLike | None = None,
) -> Path:
    """Write a motion in the format of another project, or as our own table.

    Args:
        motion: A human or a robot motion, or the file of one.
        file: File for the result.
        to: Name of the format (docs/formats.md); without it the file's suffix decides: `.parquet`
            is our table, `.bvh` and `.csv` are the formats of these names.
        robot: The one that a robot's motion was made for; None finds it.

    Returns:
        The path of the file.

    Raises:
        UnknownName: no such format, or none for such a motion.
        RejectedReference: the robot's model has changed since the motion was made.
        StoreError: the file cannot be written.
    """
    found = motion
    if not isinstance(found, SmplSequence | ReferenceMotion):
        found = read_motion(found)
    path = Path(file)
    if not isinstance(motion, SmplSequence | ReferenceMotion):
        require_another(Path(motion), path)
    if to is None and path.suffix == TABLE:
        return found.save(path)
    name = to or path.suffix.removeprefix(".")
    held = "this is" if motion is found else f"{motion} holds"
    if isinstance(found, SmplSequence):
        writer = format_of(name, registry.person_exporters(), f"{held} a person's motion")
        content = writer.write(found)
    else:
        exporter = format_of(name, registry.robot_exporters(), f"{held} a robot's motion")
        content = exporter.write(found, _machine(found, robot).model)
    FileTree(path.parent).write(path.name, content)
    return path


def _machine(motion: ReferenceMotion, robot: RobotLike | None) -> Robot:
    return robot_of(motion) if robot is None else require_robot(motion, load_robot(robot))


def require_another(source: Path, out: Path) -> None:
    """Refuse to write a result over what it is made from, or over a table or network of a stage.

    Raises:
        StoreError: both are one file, or `out` is a file that a stage wrote.
    """
    if out.exists() and source.exists() and out.samefile(source):
        raise StoreError(f"{out}: is the motion itself; write the result to another file")
    if out.is_file() and out.suffix in OF_STAGES:
        raise StoreError(f"{out}: is what a stage wrote; write the result to another file")
