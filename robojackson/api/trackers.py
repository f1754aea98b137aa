"""Trackers: policies that follow any reference motion with one robot, untrained on it."""

from robojackson.pipeline.tracker_descriptions import describe_tracker
from robojackson.rl.trackers.tracker import Tracker
from robojackson.rl.trackers.tracker_file import open_tracker


def load_tracker(name: str) -> Tracker:
    """Load a tracker, for `evaluate_policy`.

    Args:
        name: Name of a file of `configs/trackers`, such as `twist2`.

    Raises:
        UnknownName: no such tracker; the message lists the known ones.
        BadPolicy: its file has to be fetched first (`robojackson trackers add NAME`), was altered,
            or is no network of its kind.
        MissingDependency: what runs it is not installed.
    """
    return open_tracker(describe_tracker(name))
