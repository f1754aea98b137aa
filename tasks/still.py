"""The picture of a move: video frame, recovered body and robot (the paper's Figures 2-4)."""

from collections.abc import Mapping
from typing import Any

from robojackson.clips.track import LandmarkTrack
from robojackson.motion.reference import ReferenceMotion
from robojackson.motion.smpl import SmplSequence
from robojackson.report.still import still as draw
from robojackson.retarget.robot import RobotDescription, load_robot
from storage import tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.caching import stage


def _models(parameters: Mapping[str, Any]) -> list[str]:
    return [load_robot(parameters["robot"]).sha256]


@stage(models=_models)
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
