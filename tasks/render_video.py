"""The video that proves it: source, skeleton, reference robot and trained robot side by side."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from robojackson.errors import UnreadableVideo
from robojackson.files.local_folder import sha256_of_file
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.rollout import Rollout
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video.side_by_side import TRAINED_TITLE, VideoConfig, side_by_side
from robojackson.robot.model import RobotDescription, load_robot
from storage import artifact_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.robot_digests import robot_models
from tasks.runtime.stage import stage


def music_digest(config: VideoConfig) -> list[str]:
    """Digest of the music that a configuration names, as a list; empty without one.

    Raises:
        UnreadableVideo: it cannot be read.
    """
    if not config.music:
        return []
    try:
        return [sha256_of_file(Path(config.music))]
    except OSError as cause:
        reason = cause.strerror or cause
        raise UnreadableVideo(f"no music there ({reason})", Path(config.music)) from cause


def _models(parameters: Mapping[str, Any]) -> list[str]:
    return [*robot_models(parameters), *music_digest(parameters["config"])]


@stage(models=_models)
def render_video(
    source: Artifact,
    landmarks: Artifact,
    sequence: Artifact,
    reference: Artifact,
    rollout: Artifact,
    robot: RobotDescription,
    config: VideoConfig,
    title: str = TRAINED_TITLE,
    name: str = "dance.mp4",
) -> Artifact:
    """Return the video as mp4.

    Args:
        title: Over the panel of the rollout.
        name: Name of the file.
    """
    store = Store.from_environment()
    with store.local(source) as path, store.scratch() as folder:
        film = side_by_side(
            path,
            artifact_tables.read(LandmarkTrack, store, landmarks),
            artifact_tables.read(SmplSequence, store, sequence),
            artifact_tables.read(ReferenceMotion, store, reference),
            artifact_tables.read(Rollout, store, rollout).qpos,
            folder / name,
            model=load_robot(robot).model,
            config=config,
            title=title,
        )
        return store.save("dance", film.name, film)
