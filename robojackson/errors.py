"""Every error that a user can cause: one class a cause, under one base.

The message names the value, the place, what is allowed and the next step; the command line prints
it as one line and exits with 1.
"""

import math
from collections.abc import Iterable
from typing import Any


class RoboJacksonError(Exception):
    """Base of all errors that are the input's fault and not a bug of ours.

    Attributes:
        reason: What is wrong and what to do, without the name of the file.
        source: The file with which it is wrong; None where there is none.
    """

    def __init__(self, reason: str, source: object = None) -> None:
        super().__init__(reason if source is None else f"{source}: {reason}")
        self.reason, self.source = reason, source

    def __reduce__(self) -> tuple[Any, ...]:
        """Let an error go to another process with its fields, for any arguments."""
        return _rebuilt, (type(self), self.args, self.__dict__)


def _rebuilt(
    cls: type[RoboJacksonError], args: tuple[object, ...], fields: dict[str, object]
) -> Any:
    error = cls.__new__(cls)
    error.args = args
    error.__dict__.update(fields)
    return error


class UnreadableVideo(RoboJacksonError):
    """The file is missing, is not a video, or ends before its first frame."""


class TruncatedVideo(UnreadableVideo):
    """The file holds fewer frames than its header promises."""


class VideoTooLong(RoboJacksonError):
    """The clip is longer than the limit of the configuration."""


class TrackTooShort(RoboJacksonError):
    """A stage that needs motion got fewer frames than it can use."""


class NoPersonFound(RoboJacksonError):
    """The pose detector found no person in the clip."""


class ViewsDisagree(RoboJacksonError):
    """Two clips that cannot be put together: they do not show the same motion."""


class UnknownName(RoboJacksonError):
    """A body, joint, site, robot, preset or column that does not exist."""

    def __init__(self, kind: str, name: str, where: str, known: Iterable[str]) -> None:
        super().__init__(f"unknown {kind} {name!r} ({where}). Known: {', '.join(sorted(known))}")
        self.kind, self.name, self.where = kind, name, where


class BadConfiguration(RoboJacksonError):
    """A YAML key or value that is not allowed; the message has the path of the key.

    Attributes:
        key: Path of the key in `source`; empty where the whole file is in question.
    """

    def __init__(self, reason: str, source: object = None, *, key: str = "") -> None:
        super().__init__(reason, source)
        self.key = key


class ConflictingValues(ValueError):
    """Values of a configuration that do not go together, each right by itself.

    Raised by the validators of configurations; the loader makes a `BadConfiguration` of it.

    Attributes:
        keys: Paths of the keys in question, from the section that refuses them.
    """

    def __init__(self, message: str, *keys: str) -> None:
        super().__init__(message)
        self.keys = keys


class BadTable(RoboJacksonError):
    """A Parquet file that violates its schema; the message has the column and the file."""


class StoreError(RoboJacksonError):
    """The store cannot be written or read (full disk, no permission, connection cut)."""


class BackupFailed(RoboJacksonError):
    """A backup that cannot be made, or is damaged, or cannot be restored."""


class BadWeights(RoboJacksonError):
    """A file of network weights that is damaged, unsafe to load, or of another network."""


class TrainingDiverged(RoboJacksonError):
    """The networks of a training hold values that are no numbers any more."""


class BadPolicy(RoboJacksonError):
    """A policy file that cannot be loaded or does not fit the reference motion."""


class RejectedReference(RoboJacksonError):
    """A reference motion that the robot cannot follow.

    Attributes:
        remedy: Change that may repair it.
        figure: Name of the figure of the score card that failed; empty where none did.
        value, limit: The figure and its limit.
        forcible: Whether `--force` goes on anyway.
    """

    def __init__(
        self,
        reason: str,
        remedy: str = "",
        *,
        figure: str = "",
        value: float = math.nan,
        limit: float = math.nan,
        forcible: bool = False,
    ) -> None:
        parts = [f"{reason}; {remedy}" if remedy else reason, *(["or --force"] if forcible else [])]
        super().__init__(", ".join(parts))
        self.reason, self.remedy, self.forcible = reason, remedy, forcible
        self.figure, self.value, self.limit = figure, value, limit

    @property
    def without_force(self) -> str:
        """The message for a caller that has no `--force`."""
        return f"{self.reason}; {self.remedy}" if self.remedy else self.reason

    def advised(self, words: Iterable[str]) -> "RejectedReference":
        """Return the error with more that may mend it."""
        remedy = "; ".join(filter(None, [self.remedy, *words]))
        return RejectedReference(
            self.reason, remedy,
            figure=self.figure, value=self.value, limit=self.limit, forcible=self.forcible,
        )  # fmt: skip

    def saved_in(self, folder: object) -> "RejectedReference":
        """Return the error with the place of the motion that was refused."""
        error = RejectedReference(self.reason, self.remedy, forcible=self.forcible)
        error.__dict__.update(self.__dict__)
        error.args = (f"{self}; it is kept in {folder}",)
        return error


class TrainingFailed(RoboJacksonError):
    """The training process died; the message names the run, the cause and its log."""


class TrainingCrashed(TrainingFailed):
    """A training process was killed; the same again may succeed."""


class MissingDependency(RoboJacksonError):
    """Something that has to be installed first; the message is the line that installs it."""


class SearchFailed(RoboJacksonError):
    """A source cannot be searched, or has nothing to offer; the message has the source and why."""


class DownloadFailed(RoboJacksonError):
    """A video of the web cannot be downloaded; the message is the reason in its table row."""


class DeploymentFailed(RoboJacksonError):
    """Prefect's server is not there, or refuses what we register with it."""


class StudyFailed(RoboJacksonError):
    """Cells of an ablation did not end well; the message names each and why."""
