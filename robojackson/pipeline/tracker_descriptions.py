"""The trackers of `configs/trackers`, by name."""

from robojackson.errors import BadConfiguration, BadPolicy
from robojackson.pipeline.configuration_files import names
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.trackers.onnx_network import has_runtime, require_runtime
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.rl.trackers.tracker_file import is_present, require_file

FOLDER = "trackers"
NONE = "none"
"""In place of a name: no tracker."""


def tracker_names() -> tuple[str, ...]:
    """Return the names of all trackers."""
    return names(FOLDER)


def describe_tracker(name: str) -> TrackerDescription:
    """Return the description of a tracker.

    Raises:
        UnknownName: there is no such tracker; the message lists those that are.
        BadConfiguration: a wrong key or value, or another name in the file than that of the file.
    """
    found = load(TrackerDescription, f"{FOLDER}/{name}")
    if found.name != name:
        raise BadConfiguration(
            f"configs/{FOLDER}/{name}.yaml: name is {found.name!r}; it must be that of the file, "
            f"{name!r}"
        )
    return found


def usual_robot() -> str:
    """Return the robot of the first tracker, for what needs a tracker and names no robot."""
    return describe_tracker(tracker_names()[0]).robot


def trackers_of(robot: str) -> list[TrackerDescription]:
    """Return the trackers that drive a robot, in the order of their names."""
    return [each for each in map(describe_tracker, tracker_names()) if each.robot == robot]


def require_for(tracker: TrackerDescription, robot: str) -> None:
    """Raise for a tracker of another robot.

    Raises:
        BadPolicy: the message lists the trackers of the robot.
    """
    if tracker.robot != robot:
        own = ", ".join(each.name for each in trackers_of(robot)) or "none"
        raise BadPolicy(f"{tracker.why_not(robot)}; for {robot}: {own}")


def default_trackers(robot: str) -> list[TrackerDescription]:
    """Return the trackers of a robot that may be selected where none is named."""
    return [each for each in trackers_of(robot) if each.by_default]


def needs_runtime(tracker: TrackerDescription) -> bool:
    """Return whether onnxruntime runs its network."""
    return tracker.network == "twist2"


def require_tracker(robot: str, name: str | None = None) -> TrackerDescription | None:
    """Return a tracker of a robot that can be run at once.

    Args:
        name: Name of the tracker; when None, the first that is here and can be run, a fallback
            last; no tracker when `none`.

    Raises:
        UnknownName: there is no such tracker.
        BadPolicy: it is for another robot, or there is none for this one; its file is not here, or
            was altered.
        MissingDependency: what runs it is not installed.
    """
    if name == NONE:
        return None
    known = default_trackers(robot) if name is None else [describe_tracker(name)]
    if not known:
        every = [f"{each.name} ({each.robot})" for each in map(describe_tracker, tracker_names())]
        raise BadPolicy(
            f"there is no tracker for robot {robot!r}; trackers: {', '.join(every)}: give their "
            "robot, as --robot g1"
        )
    here = [each for each in known if is_present(each)] or known
    if name is None:
        here = [each for each in here if has_runtime() or not needs_runtime(each)] or here
    chosen = min(here, key=lambda each: each.fallback)
    require_for(chosen, robot)
    if require_file(chosen) is not None and needs_runtime(chosen):
        require_runtime()
    return chosen
