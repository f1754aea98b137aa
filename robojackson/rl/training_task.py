"""What a training run learns, and how it ended."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from robojackson.motion.reference_motion import ReferenceMotion, motions_of, poses_sha256
from robojackson.robot.model import Robot


@dataclass(frozen=True)
class Task:
    """What is being learnt: a checkpoint of another one cannot be continued.

    Attributes:
        robot: Name of the robot.
        model_sha256: Digest of its MJCF.
        reference_sha256: Digest of the reference's poses; of several, the digest of their digests.
    """

    robot: str
    model_sha256: str
    reference_sha256: str

    @staticmethod
    def of(reference: ReferenceMotion | Sequence[ReferenceMotion], robot: Robot) -> "Task":
        """The task of following a reference, or several, with a robot."""
        digests = [poses_sha256(motion) for motion in motions_of(reference)]
        joined = hashlib.sha256("".join(digests).encode()).hexdigest()
        found = digests[0] if len(digests) == 1 else joined
        return Task(robot.description.name, robot.sha256, found)


@dataclass(frozen=True)
class TrainResult:
    """How a training run ended.

    Attributes:
        policy: The policy's file.
        steps, updates: Control steps and gradient updates in all.
        seconds: Wall time in all, resumptions included.
        stopped: `steps` or `minutes`: the budget that ended the run.
    """

    policy: Path
    steps: int
    updates: int
    seconds: float
    stopped: str
