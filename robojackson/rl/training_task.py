"""The task of a training run, and its result."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from robojackson.motion.reference_motion import ReferenceMotion, motions_of, poses_sha256
from robojackson.robot.description import description_sha256
from robojackson.robot.model import Robot

OLDER_TQC = {"n_steps": 1}
"""Numbers of TQC from before they could be chosen."""


@dataclass(frozen=True)
class Task:
    """Task of a training: a checkpoint of another task cannot be continued.

    Attributes:
        robot: Name of the robot.
        model_sha256: Digest of its MJCF.
        reference_sha256: Digest of the reference's poses; of several, the digest of their digests.
        description_sha256: Digest of the robot's YAML: gains, limits, friction, rules.
    """

    robot: str
    model_sha256: str
    reference_sha256: str
    description_sha256: str

    @staticmethod
    def of(reference: ReferenceMotion | Sequence[ReferenceMotion], robot: Robot) -> "Task":
        """Return the task of following a reference, or several, with a robot."""
        digests = [poses_sha256(motion) for motion in motions_of(reference)]
        joined = hashlib.sha256("".join(digests).encode()).hexdigest()
        found = digests[0] if len(digests) == 1 else joined
        return Task(
            robot.description.name, robot.sha256, found, description_sha256(robot.description)
        )

    def completing(self, configuration: Mapping[str, object]) -> dict[str, object]:
        """Return the configuration of a checkpoint that lacks what older ones did not keep."""
        parts = [configuration.get(name) for name in ("task", "tqc", "track")]
        task, tqc, track = (part if isinstance(part, dict) else {} for part in parts)
        if not (task and tqc and track):
            return {}
        # An older training with a robot's own measurements had the exact root or no feedback.
        known = None if track.get("observation") == "full" else "exact"
        control = {"root_state": known, **track["control"]}
        return {
            **configuration,
            "task": {**asdict(self), **task},
            "tqc": {**OLDER_TQC, **tqc},
            "track": {**track, "control": control},
        }


@dataclass(frozen=True)
class TrainResult:
    """The result of a training run.

    Attributes:
        policy: The policy's file.
        steps, updates: Total control steps and gradient updates.
        seconds: Total wall time, including resumptions.
        stopped: Budget that ended the run, such as `steps` or `minutes`.
    """

    policy: Path
    steps: int
    updates: int
    seconds: float
    stopped: str
