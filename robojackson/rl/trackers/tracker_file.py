"""The file of a tracker in the store, and the tracker that it contains."""

from collections.abc import Callable, Mapping
from pathlib import Path

from robojackson.errors import BadPolicy
from robojackson.files.local_folder import sha256_of_file
from robojackson.rl.trackers.policy_tracker import PolicyTracker
from robojackson.rl.trackers.regulator_tracker import RegulatorTracker
from robojackson.rl.trackers.tracker import Tracker
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.rl.trackers.twist2 import Twist2Tracker
from robojackson.robot.mjcf import robots_folder

NETWORKS: Mapping[str, Callable[[TrackerDescription, Path], Tracker]] = {
    "twist2": Twist2Tracker,
    "policy": PolicyTracker,
}
"""Classes by `TrackerDescription.network`."""
ASSETS = Path(__file__).parent.parent.parent / "assets"


def tracker_path(description: TrackerDescription) -> Path | None:
    """Return the path of a shipped tracker's file, or of `robojackson trackers add`'s; None for one
    without a file."""
    if description.file is None:
        return None
    if description.file.url is None:
        return ASSETS / description.file.name
    return robots_folder().parent / "trackers" / description.name / description.file.name


def is_present(description: TrackerDescription) -> bool:
    """Return whether the file of a tracker exists; its digest is not checked."""
    path = tracker_path(description)
    return path is None or path.is_file()


def require_file(description: TrackerDescription, file: Path | None = None) -> Path | None:
    """Return the file of a tracker; None for one without a file.

    Args:
        file: Path of the file, if not in the store.

    Raises:
        BadPolicy: the file is missing, or is not the expected one.
    """
    path, name = file or tracker_path(description), description.name
    if description.file is None or path is None:
        return None
    how = f"run: robojackson trackers add {name}"
    if description.file.url is None:
        how = "install RoboJackson again"
    if not path.is_file():
        raise BadPolicy(f"tracker {name!r} is not installed ({path}); {how}")
    if sha256_of_file(path) != description.file.sha256:
        raise BadPolicy(f"tracker {name!r}: {path} has been altered; {how}")
    return path


def open_tracker(description: TrackerDescription, file: Path | None = None) -> Tracker:
    """Load the network of a tracker.

    Args:
        file: The expected file, if not in the store.

    Raises:
        BadPolicy: the file is missing, altered, or not a network of its kind.
        MissingDependency: the package that runs it is not installed.
    """
    path = require_file(description, file)
    if path is None or description.network == "regulator":
        return RegulatorTracker(description, path)
    return NETWORKS[description.network](description, path)
