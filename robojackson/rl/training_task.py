"""The task of a training run, and its result."""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from robojackson.errors import BadConfiguration
from robojackson.motion.reference_motion import ReferenceMotion, motions_of, poses_sha256
from robojackson.rl.checkpoint_folder import newest_checkpoint, restoring
from robojackson.rl.config.tqc_config import PRESETS, ActorStart
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.modes.track_mode import control_of
from robojackson.robot.description import description_sha256
from robojackson.robot.model import Robot

NOT_OF_THE_RUN = (
    *("steps", "minutes", "cpu_minutes", "checkpoint_seconds", "progress_seconds", "tensorboard"),
)
"""Keys that may differ between two sittings."""
OLDER_TQC = {"n_steps": 1}
"""Numbers of TQC from before they could be chosen."""
OLDER_RANDOM = {"least": 1.0}
"""Ranges of physics from before they could be graded."""
OLDER_TRACK = {"differences": False}
"""Numbers of the environment from before they could be chosen."""
OLDER_REWARD = {"polished_fine": 0.5, "polished_narrow": 0.35}
"""Numbers of the reward from before they could be chosen."""
NOT_GIVEN = "not_given"
"""Key of checkpoints in which what was not given is null; older ones hold its default."""
SHOWN = 4
"""Differences that a message names at most."""
LONGEST = 60
"""Characters of a value in a message."""


@dataclass(frozen=True)
class Task:
    """Task of a training: a checkpoint of another task cannot be continued.

    Attributes:
        robot: Name of the robot.
        model_sha256: Digest of its MJCF.
        reference_sha256: Digest of the reference's poses; of several, the digest of their digests.
        description_sha256: Digest of the robot's YAML: gains, limits, friction, rules.
        imu: Place of its accelerometer in the frame of the root, m.
    """

    robot: str
    model_sha256: str
    reference_sha256: str
    description_sha256: str
    imu: tuple[float, ...] = (0.0, 0.0, 0.0)

    @staticmethod
    def of(reference: ReferenceMotion | Sequence[ReferenceMotion], robot: Robot) -> "Task":
        """Return the task of following a reference, or several, with a robot."""
        digests = [poses_sha256(motion) for motion in motions_of(reference)]
        joined = hashlib.sha256("".join(digests).encode()).hexdigest()
        found = digests[0] if len(digests) == 1 else joined
        return Task(
            robot.description.name,
            robot.sha256,
            found,
            description_sha256(robot.description, robot.joint_names),
            tuple(robot.description.imu),
        )

    def identity(self, config: TrainConfig) -> dict[str, object]:
        """Return the task and the configuration without the budget: what a training that goes on
        must share."""
        fields = asdict(config)
        fields["track"]["control"] = asdict(control_of(config.track))
        for free in NOT_OF_THE_RUN:
            del fields[free]
        fields |= {"task": asdict(self), NOT_GIVEN: None}
        result: dict[str, object] = json.loads(json.dumps(fields))
        return result

    def require_own(self, out: Path, config: TrainConfig) -> None:
        """Raise where a folder holds a checkpoint that another training wrote.

        Raises:
            BadConfiguration: the message names what differs.
            StoreError: the checkpoint is damaged.
        """
        folder = newest_checkpoint(out)
        if folder is None:
            return
        with restoring(folder):
            kept = json.loads((folder / "run.json").read_text())["configuration"]
            self.require_same(kept, self.identity(config), folder)

    def require_same(
        self, kept: Mapping[str, object], now: Mapping[str, object], folder: Path
    ) -> None:
        """Raise for a checkpoint that another training wrote.

        Args:
            kept: Configuration of the checkpoint.
            now: That of the training that would continue it.
            folder: The checkpoint.

        Raises:
            BadConfiguration: the message names what differs.
        """
        self._require_same_robot_and_motion(kept, folder)
        apart = list(_differences(self._completed(kept), now))
        if apart:
            raise BadConfiguration(
                f"{folder} belongs to another configuration, reference motion or robot "
                f"({'; '.join(apart[:SHOWN])}); remove it or choose another folder"
            )

    def _require_same_robot_and_motion(self, kept: Mapping[str, object], folder: Path) -> None:
        """Name the robot or the motion that differs, of which there are digests alone."""
        task = kept.get("task")
        then = task if isinstance(task, dict) else {}
        if then.get("robot", self.robot) != self.robot:
            what = f"robot {then['robot']!r}, and this is of {self.robot!r}"
        elif then.get("reference_sha256", self.reference_sha256) != self.reference_sha256:
            what = f"another reference motion of robot {self.robot!r}"
        else:
            return
        raise BadConfiguration(
            f"{folder} belongs to a training of {what}; remove it or choose another folder"
        )

    def _completed(self, kept: Mapping[str, object]) -> dict[str, object]:
        """Return the configuration of a checkpoint with what older ones did not keep."""
        parts = [kept.get(name) for name in ("task", "tqc", "track")]
        task, tqc, track = (part if isinstance(part, dict) else {} for part in parts)
        if not (task and tqc and track):
            return {}
        settings = completed_settings(kept)
        return {**settings, "task": {**json.loads(json.dumps(asdict(self))), **task}}


def completed_settings(kept: Mapping[str, object]) -> dict[str, object]:
    """Return the configuration of a checkpoint with the settings of then that older ones did not
    keep."""
    tqc, track = kept.get("tqc"), kept.get("track")
    if not isinstance(tqc, dict) or not isinstance(track, dict):
        return dict(kept)
    sections = {
        "control": _older_control(track),
        "random": {**OLDER_RANDOM, **track.get("random", {})},
        "reward": {**OLDER_REWARD, **track.get("reward", {})},
    }
    tqc = {**OLDER_TQC, **(tqc if NOT_GIVEN in kept else _older_start(tqc))}
    return {**kept, "tqc": tqc, "track": {**OLDER_TRACK, **track, **sections}}


def _older_start(tqc: Mapping[str, Any]) -> dict[str, object]:
    """Return the numbers of TQC of a checkpoint from before zeros could be given: what equals its
    default counted as not given."""
    usual, named = asdict(ActorStart()), PRESETS.get(tqc.get("preset", ""), {})
    unset = {name for name, value in usual.items() if name not in named and tqc.get(name) == value}
    return {name: None if name in unset else value for name, value in tqc.items()}


def _older_control(track: Mapping[str, Any]) -> dict[str, object]:
    """Return the control law of a checkpoint; where it is from before roots were estimated, that of
    then: policies that do not see the full state had no feedback unless it was set."""
    control: dict[str, object] = dict(track["control"])
    if "root_state" in control:
        return control
    full = track.get("observation") == "full"
    if control.get("feedback") is None and not full:
        control["feedback"] = 0.0
    measured = track.get("observation") in ("onboard", "preview")
    exact = measured and control.get("feedback") != 0
    return {**control, "root_state": "exact" if exact else None}


def _differences(kept: object, now: object, name: str = "") -> Iterator[str]:
    """Yield the keys at which two configurations differ, with both values."""
    if isinstance(kept, Mapping) and isinstance(now, Mapping):
        for key in sorted({*kept, *now}):
            inner = f"{name}.{key}" if name else str(key)
            yield from _differences(kept.get(key), now.get(key), inner)
    elif kept != now:
        then, here = (json.dumps(each)[:LONGEST] for each in (kept, now))
        yield f"{name}: {then} there, {here} here"


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
