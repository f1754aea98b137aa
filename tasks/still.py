"""Pictures: of a move (the paper's Figures 2-4), and of the film of a dance."""

from robojackson.clips.track import LandmarkTrack
from robojackson.motion.reference import ReferenceMotion
from robojackson.motion.smpl import SmplSequence
from robojackson.report.still import middle_of
from robojackson.report.still import still as draw
from robojackson.retarget.robot import RobotDescription, load_robot
from storage import tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.caching import stage
from tasks.robots import robot_models


@stage(models=robot_models)
def still(
    source: Artifact,
    landmarks: Artifact,
    sequence: Artifact,
    reference: Artifact,
    robot: RobotDescription,
) -> Artifact:
    """A PNG."""
    store = Store.from_environment()
    with store.local(source) as path:
        picture = draw(
            path,
            tables.read(LandmarkTrack, store, landmarks),
            tables.read(SmplSequence, store, sequence),
            tables.read(ReferenceMotion, store, reference),
            load_robot(robot).model,
        )
    return store.keep("still", "still.png", picture)


@stage()
def snapshot(film: Artifact) -> Artifact:
    """Keep a PNG of the middle of a film."""
    store = Store.from_environment()
    with store.local(film) as path:
        return store.keep("still", "still.png", middle_of(path))
