"""The folder of a run: what `dance` leaves beside its page, by a trained policy or by a tracker."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from robojackson.api.arguments import robot_of
from robojackson.errors import StoreError
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.rollout import Rollout
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.web.player_data import Player, player
from robojackson.robot.model import Robot

FPS = 30.0
ROLLOUTS = "rollout.parquet", "tracker_rollout.parquet"
FILMS = "dance.mp4", "tracker.mp4"
"""What the policy made, else the tracker."""


@dataclass(frozen=True)
class RunFolder:
    """A run.

    Attributes:
        robot: The robot that danced.
        track, sequence, reference: Landmarks, person and target.
        rollout: The recorded dance.
        shown: All of it, 30 pictures a second from its first moment to its last.
    """

    robot: Robot
    track: LandmarkTrack
    sequence: SmplSequence
    reference: ReferenceMotion
    rollout: Float[np.ndarray, "S nq"]
    shown: Player


def read_run(folder: Path) -> RunFolder:
    """Read the folder of a run.

    Raises:
        StoreError: it is not the folder of a run, or a table is missing.
        RejectedReference: the robot's model has changed since.
    """
    rollout = Rollout.load(one_of(folder, ROLLOUTS)).qpos
    track = LandmarkTrack.load(folder / "landmarks.parquet")
    sequence = SmplSequence.load(folder / "smpl.parquet")
    reference = ReferenceMotion.load(folder / "reference.parquet")
    robot = robot_of(reference)
    shown = player(track, sequence, reference, rollout, robot, FPS, math.inf)
    return RunFolder(robot, track, sequence, reference, rollout, shown)


def one_of(folder: Path, names: tuple[str, ...]) -> Path:
    """Return the first of these files that is in the folder of a run.

    Raises:
        StoreError: the folder has none of them.
    """
    found = next((folder / name for name in names if (folder / name).is_file()), None)
    if found is None:
        raise StoreError(
            f"{folder}: not the folder of a run, which has {' or '.join(names)}; "
            "`robojackson dance` names its folder at the end"
        )
    return found
