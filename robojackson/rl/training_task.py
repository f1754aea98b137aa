"""What a training run learns, and how it ended."""

from dataclasses import dataclass
from pathlib import Path

from robojackson.motion.reference_motion import ReferenceMotion, poses_sha256
from robojackson.robot.model import Robot


@dataclass(frozen=True)
class Task:
    """What is being learnt: a checkpoint of another one cannot be continued.

    Attributes:
        robot: Name of the robot.
        model_sha256: Digest of its MJCF.
        reference_sha256: Digest of the reference's poses.
    """

    robot: str
    model_sha256: str
    reference_sha256: str

    @staticmethod
    def of(reference: ReferenceMotion, robot: Robot) -> "Task":
        """The task of following a reference with a robot."""
        return Task(robot.description.name, robot.sha256, poses_sha256(reference))


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
