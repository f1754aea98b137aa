"""Whether a policy that a command was given is a file or the name of a tracker."""

from pathlib import Path

from robojackson.errors import UnknownName
from robojackson.pipeline.tracker_descriptions import tracker_names


def is_tracker(policy: Path) -> bool:
    """Return whether a policy is the name of a tracker; a file of that name takes precedence.

    Raises:
        UnknownName: a bare name of neither.
    """
    if policy.is_file() or len(policy.parts) > 1 or policy.suffix:
        return False
    known = tracker_names()
    if not policy.exists() and str(policy) not in known:
        raise UnknownName("tracker", str(policy), "nor is it a file", known)
    return str(policy) in known
