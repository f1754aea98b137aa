"""Files of other projects: recognised, read onto our floor, and the formats by name."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, TypeVar

from robojackson.errors import BadConfiguration, BadTable, UnknownName
from robojackson.files.file_tree import FileTree
from robojackson.files.foreign_file import read_file
from robojackson.files.table_door import column_names
from robojackson.formats.foreign_motion import (
    Y_UP_TO_WORLD,
    Z_UP_TO_WORLD,
    ForeignMotion,
    HybrikMotion,
)
from robojackson.formats.format import Importer
from robojackson.formats.registry import policy_exporters, recognise
from robojackson.mocap.imported_motion import (
    ground_foreign_motion,
    ground_hybrik_motion,
    kinematics_error_mm,
)
from robojackson.mocap.recover import MocapConfig
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.rl.policy import Policy, load_policy

SLOWEST, FASTEST = 1.0, 1000.0
"""Frames a second."""
AXES = {"y": Y_UP_TO_WORLD, "z": Z_UP_TO_WORLD}
Up = Literal["y", "z"]
Exporter = TypeVar("Exporter")


@dataclass(frozen=True)
class ForeignFile:
    """Content of another project's file.

    Attributes:
        motion: Motion on the floor.
        format: Name of the format.
        figures: `kinematics_error_mm` of HybrIK's files: how far our joints are from theirs.
    """

    motion: SmplSequence
    format: str
    figures: Mapping[str, float | None] = field(default_factory=dict)


def read_foreign(file: Path, fps: float | None, up: Up | None, config: MocapConfig) -> ForeignFile:
    """Read a human motion of another project; nothing in the file is executed.

    Raises:
        StoreError: the file cannot be read.
        UnknownName, BadTable: no known format, a damaged file, or one that would run code.
        BadConfiguration: a frame rate that no motion has, or axes that the file has not.
    """
    data = read_file(file)
    importer = recognise(data, str(file))
    with _naming_the_file(file):
        motion = importer.read(data)
    rate, notes = _rate(motion, importer, fps)
    figures: dict[str, float | None] = {}
    if isinstance(motion, HybrikMotion):
        if up:
            raise BadConfiguration("--up is for files with a world; HybrIK's are in camera axes")
        with _naming_the_file(file):
            sequence = ground_hybrik_motion(motion, rate, config)
        figures["kinematics_error_mm"] = kinematics_error_mm(motion)
    else:
        axes = motion.to_world if up is None else AXES[up]
        with _naming_the_file(file):
            sequence = ground_foreign_motion(replace(motion, to_world=axes), rate)
    sequence = replace(sequence, notes=(*sequence.notes, *notes))
    SmplSequence.from_bytes(sequence.to_bytes(), str(file))  # what no command could read is refused
    return ForeignFile(sequence, importer.name, figures)


def holds_a_person(source: Path) -> bool:
    """Return whether a Parquet file has SMPL's columns.

    Raises:
        StoreError: no such file.
        BadTable: it is no Parquet file.
    """
    return "global_orient" in column_names(read_file(source), source)


def format_of(name: str, known: Mapping[str, Exporter], what: str) -> Exporter:
    """Return the exporter of that name.

    Args:
        known: Those that write what is at hand.
        what: What is at hand, as a clause.

    Raises:
        UnknownName: the name is not among them.
    """
    if name not in known:
        raise UnknownName("format", name, f"--to; {what}", known)
    return known[name]


def write_policy(source: Path, file: Path, to: str) -> Policy:
    """Write a policy in the format of another project, such as `onnx`; return it.

    Raises:
        UnknownName: no such format of policies.
        BadPolicy: the file is no policy of ours.
        MissingDependency: the package that writes the format is not installed.
        StoreError: the file cannot be written.
    """
    exporter = format_of(to, policy_exporters(), f"{source} holds a policy")
    policy = load_policy(source)
    FileTree(file.parent).write(file.name, exporter.write(policy))
    return policy


@contextmanager
def _naming_the_file(file: Path) -> Iterator[None]:
    """Add the file's name to errors."""
    try:
        yield
    except BadTable as cause:
        raise BadTable(f"{file}: {cause}") from cause


def _rate(
    motion: ForeignMotion | HybrikMotion, importer: Importer, given: float | None
) -> tuple[float, list[str]]:
    """Return frames a second, and a note about them for the user."""
    stored_fps = motion.fps if isinstance(motion, ForeignMotion) else None
    rate = given or stored_fps or importer.fps
    if rate is None:
        raise BadConfiguration(
            f"this {importer.name} file does not give its frame rate: give it with --fps"
        )
    if not SLOWEST <= rate <= FASTEST:
        raise BadConfiguration(
            f"{rate:g} frames a second: allowed are {SLOWEST:g} to {FASTEST:g}; give it with --fps"
        )
    if given and stored_fps and abs(given - stored_fps) > 0.01:
        return rate, [f"the file has {stored_fps:g} frames a second: {given:g} was given"]
    if not given and not stored_fps:
        return rate, [f"the file does not give its frame rate: taken as {rate:g}; --fps changes it"]
    return rate, []
