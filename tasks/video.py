"""The video that proves it: source, skeleton, reference robot and trained robot side by side."""

from robojackson.clips.track import LandmarkTrack
from robojackson.motion.reference import ReferenceMotion
from robojackson.motion.smpl import SmplSequence
from robojackson.report.video import VideoConfig, side_by_side
from robojackson.retarget.robot import RobotDescription, load_robot
from storage import tables
from storage.artifact import Artifact
from storage.codecs import Rollout
from storage.store import Store
from tasks.caching import stage
from tasks.robots import robot_models


@stage(models=robot_models)
def video(
    source: Artifact,
    landmarks: Artifact,
    sequence: Artifact,
    reference: Artifact,
    rollout: Artifact,
    robot: RobotDescription,
    config: VideoConfig,
) -> Artifact:
    """An mp4."""
    store = Store.from_environment()
    with store.local(source) as path, store.scratch() as folder:
        film = side_by_side(
            path,
            tables.read(LandmarkTrack, store, landmarks),
            tables.read(SmplSequence, store, sequence),
            tables.read(ReferenceMotion, store, reference),
            tables.read(Rollout, store, rollout).qpos,
            folder / "dance.mp4",
            model=load_robot(robot).model,
            config=config,
        )
        return store.keep("dance", film.name, film)
