"""The file of a tracker in the store, and the tracker that it contains."""

from collections.abc import Callable, Mapping
from pathlib import Path

from robojackson.errors import BadPolicy
from robojackson.files.store_files import copy_file_here, files_here, is_shared, is_whole
from robojackson.rl.trackers.policy_tracker import PolicyTracker
from robojackson.rl.trackers.regulator_tracker import RegulatorTracker
from robojackson.rl.trackers.tracker import Tracker
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.rl.trackers.twist2 import Twist2Tracker

NETWORKS: Mapping[str, Callable[[TrackerDescription, Path], Tracker]] = {
    "twist2": Twist2Tracker,
    "policy": PolicyTracker,
}
"""Classes by `TrackerDescription.network`."""
FOLDER = "trackers"
"""Where a store has the files of added trackers, a folder each."""
ASSETS = Path(__file__).parent.parent.parent / "assets"


def tracker_key(description: TrackerDescription) -> str | None:
    """Return the key of the file in a store where `robojackson trackers add` puts it; None for a
    tracker without a file, or with one that ships."""
    if description.file is None or description.file.url is None:
        return None
    return f"{FOLDER}/{description.name}/{description.file.name}"


def tracker_path(description: TrackerDescription) -> Path | None:
    """Return the path of a shipped tracker's file, or of an added one's on this machine; None for
    one without a file."""
    if description.file is None:
        return None
    key = tracker_key(description)
    return ASSETS / description.file.name if key is None else files_here() / key


def is_present(description: TrackerDescription) -> bool:
    """Return whether the file of a tracker exists here or in the store; its digest is not
    checked."""
    path, key = tracker_path(description), tracker_key(description)
    return path is None or path.is_file() or (key is not None and is_shared(key))


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
    expected, key = description.file.sha256, tracker_key(description)
    if file is None and key is not None and not is_whole(path, expected):
        copy_file_here(key, expected)  # another machine may have added it
    how = f"run: robojackson trackers add {name}"
    if description.file.url is None:
        how = "install RoboJackson again"
    if not path.is_file():
        raise BadPolicy(f"tracker {name!r} is not installed ({path}); {how}")
    if not is_whole(path, expected):
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
