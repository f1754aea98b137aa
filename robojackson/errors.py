"""Every error that a user can cause: one class a cause, under one base.

The message names the value, the place, what is allowed and the next step; the command line prints
it as one line and exits with 1.
"""

from collections.abc import Iterable


class RoboJacksonError(Exception):
    """Base of all errors that are the input's fault and not a bug of ours."""


class UnreadableVideo(RoboJacksonError):
    """The file is missing, is not a video, or ends before its first frame."""


class TruncatedVideo(UnreadableVideo):
    """The file holds fewer frames than its header promises."""


class VideoTooLong(RoboJacksonError):
    """The clip is longer than the limit of the configuration."""


class TrackTooShort(RoboJacksonError):
    """A stage that needs motion got fewer frames than it can use."""


class NoPersonFound(RoboJacksonError):
    """The pose detector found nobody in the clip."""


class UnknownName(RoboJacksonError):
    """A body, joint, site, robot, preset or column that does not exist."""

    def __init__(self, kind: str, name: str, where: str, known: Iterable[str]) -> None:
        super().__init__(f"unknown {kind} {name!r} ({where}). Known: {', '.join(sorted(known))}")
        self.kind, self.name, self.where = kind, name, where


class BadConfiguration(RoboJacksonError):
    """A YAML key or value that is not allowed; the message has the path of the key."""


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
    """A reference motion that the robot cannot follow; the message names the figure that failed."""


class TrainingFailed(RoboJacksonError):
    """The training process died; the message says which run, how and where its log is."""


class TrainingCrashed(TrainingFailed):
    """A training process was killed; the same again may succeed."""


class MissingDependency(RoboJacksonError):
    """Something that has to be installed first; the message is the line that brings it."""


class SearchFailed(RoboJacksonError):
    """A source cannot be searched, or has nothing to offer; the message has the source and why."""


class DownloadFailed(RoboJacksonError):
    """A video of the web cannot be had; the message is the reason that its table row gets."""


class DeploymentFailed(RoboJacksonError):
    """Prefect's server is not there, or refuses what we register with it."""


class StudyFailed(RoboJacksonError):
    """Cells of an ablation did not end well; the message names each and why."""
