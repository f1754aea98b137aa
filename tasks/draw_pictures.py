"""Pictures: of a move (the paper's Figures 2-4), and of the film of a dance."""

from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video.still_picture import middle_of, still
from robojackson.robot.model import RobotDescription, load_robot
from storage import artifact_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.robot_digests import robot_models
from tasks.runtime.stage import stage


@stage(models=robot_models)
def draw_still(
    source: Artifact,
    landmarks: Artifact,
    sequence: Artifact,
    reference: Artifact,
    robot: RobotDescription,
) -> Artifact:
    """Return a PNG."""
    store = Store.from_environment()
    with store.local(source) as path:
        picture = still(
            path,
            artifact_tables.read(LandmarkTrack, store, landmarks),
            artifact_tables.read(SmplSequence, store, sequence),
            artifact_tables.read(ReferenceMotion, store, reference),
            load_robot(robot).model,
        )
    return store.save("still", "still.png", picture)


@stage()
def draw_snapshot(film: Artifact) -> Artifact:
    """Keep a PNG of the middle of a film."""
    store = Store.from_environment()
    with store.local(film) as path:
        return store.save("still", "still.png", middle_of(path))
