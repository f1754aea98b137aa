"""Arguments of the public functions: a path, or the result of an earlier function."""

import platform
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TypeVar

from robojackson.api.progress_bar import bar
from robojackson.errors import RejectedReference, UnknownName
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.rollout import Rollout
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.robot_descriptions import describe_robot, robot_names
from robojackson.robot.description import RobotDescription
from robojackson.robot.model import Robot
from robojackson.robot.model import load_robot as bind_robot

FilePath = str | PathLike[str]
Counter = Callable[[int, int], None]
"""Called with (done, in all)."""
Progress = bool | Counter
"""True shows a bar on stderr, False nothing; a function is called with (done, in all)."""
RobotLike = str | PathLike[str] | RobotDescription | Robot
Table = TypeVar("Table", LandmarkTrack, SmplSequence, ReferenceMotion, Rollout)


def path_of(given: object, name: str, instead: str = "") -> Path:
    """Return a path that was given as an argument.

    Args:
        name: What the argument is.
        instead: What else it may be, after "a file".

    Raises:
        TypeError: it is no path.
    """
    if isinstance(given, str | PathLike):
        return Path(given)
    raise TypeError(f"{name} is {given!r:.100}: expected a file{instead}")


def read_if_path(kind: type[Table], given: FilePath | Table) -> Table:
    """Return the value itself, or what its Parquet file holds.

    Raises:
        StoreError: no such file.
        BadTable: it holds another table, or a damaged one.
        TypeError: it is something else.
    """
    if isinstance(given, kind):
        return given
    return kind.load(path_of(given, "the motion", f" or {kind.__name__}"))


def robot_of(reference: ReferenceMotion) -> Robot:
    """Return the robot that a reference motion was made for.

    Raises:
        UnknownName: its description is missing; the message names the option.
        RejectedReference: its model has changed since.
    """
    return require_robot(reference, bind_robot(description_of(reference)))


def description_of(reference: ReferenceMotion) -> RobotDescription:
    """Return the description of the robot that a reference motion was made for.

    Raises:
        UnknownName: it is missing; the message names the option.
    """
    name, file = reference.robot, reference.robot_file
    if file and not Path(file).is_file():
        where = f"the motion was made for {file}, which is not on {platform.node()}"
    elif not file and name not in robot_names():
        where = "the motion does not name its description"
    else:
        return describe_robot(file or name)
    advice = f"{where}; give --robot FILE, in Python robot="
    raise UnknownName("robot", name, advice, robot_names())


def require_robot(reference: ReferenceMotion, robot: Robot) -> Robot:
    """Return the robot itself, if the reference motion was made for its model.

    Raises:
        RejectedReference: it was made for another.
    """
    if robot.sha256 != reference.model_sha256:
        own = robot.description.name
        other = f"robot {reference.robot!r}, not for {own!r}"
        if own == reference.robot:
            other = (
                f"another model of {own!r} (sha256 {reference.model_sha256[:12]}..., here "
                f"{robot.sha256[:12]}...)"
            )
        raise RejectedReference(
            f"the reference motion was made for {other}", "retarget the motion again"
        )
    for kind in ("joint_names", "body_names", "keypoint_names", "contact_names"):
        said, known = getattr(reference, kind), getattr(robot, kind)
        if said != known:
            odd = next((a for a, b in zip(said, known, strict=False) if a != b), "their number")
            raise RejectedReference(
                f"the reference motion's {kind} are not those of {reference.robot!r}, in its order "
                f"(first difference: {odd})",
                "retarget the motion again",
            )
    return robot


@contextmanager
def counter(progress: Progress, label: str) -> Iterator[Counter | None]:
    """Yield what a stage calls with (done, in all); None where no progress is requested."""
    if progress is True:
        with bar(label) as advance:
            yield advance
    else:
        yield progress or None
