"""A motion or a policy in the file format of another project, from file to file, with no Prefect.

What the file holds decides which formats fit: a robot's motion, a person's motion or a policy.
"""

import io
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import pyarrow as pa
import pyarrow.parquet as pq

from robojackson.cli import stages
from robojackson.errors import BadTable, StoreError, UnknownName
from robojackson.formats import registry
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.file_tree import FileTree

Exporter = TypeVar("Exporter")
POLICY_SUFFIX = ".safetensors"


def export(source: Path, to: str, out: Path) -> dict[str, Any]:
    """Write a robot's motion, a person's motion or a policy as `to`.

    Raises:
        UnknownName: no such format, or none for what the file holds.
        RejectedReference: the robot's model has changed since the motion was made.
        BadPolicy: it is no policy file of ours.
        MissingDependency: the package that writes the format is not installed.
        StoreError: the file cannot be read, or the result not written.
    """
    began = time.monotonic()
    _require_another(source, out)
    stages.require_file(source)
    if source.suffix == POLICY_SUFFIX:
        content, about = _policy(source, to)
    elif holds_a_person(source):
        content, about = _person(source, to)
    else:
        content, about = _robot(source, to)
    files = FileTree(out.parent)
    files.require_writable()
    files.write(out.name, content)
    figures = {"file": str(out), "format": to, **about, "bytes": len(content)}
    return figures | {"seconds": time.monotonic() - began}


def names() -> list[str]:
    """Return the formats that something can be written in, by what a file has to hold."""
    kinds: dict[str, Mapping[str, object]] = {
        "a robot's motion": registry.robot_exporters(),
        "a person's motion": registry.person_exporters(),
        "a policy": registry.policy_exporters(),
    }
    return [f"{kind}: {', '.join(sorted(found))}" for kind, found in kinds.items()]


def _policy(source: Path, to: str) -> tuple[bytes, dict[str, Any]]:
    from robojackson.rl.policy import load_policy

    exporter = _fitting(to, registry.policy_exporters(), source, "a policy")
    policy = load_policy(source)
    sizes = {"observations": policy.observation_size, "actions": len(policy.layers[-1][1])}
    return exporter.write(policy), sizes


def _person(source: Path, to: str) -> tuple[bytes, dict[str, Any]]:
    exporter = _fitting(to, registry.person_exporters(), source, "a person's motion")
    motion = stages.read_table(SmplSequence, source)
    return exporter.write(motion), {"frames": len(motion), "fps": motion.fps}


def _robot(source: Path, to: str) -> tuple[bytes, dict[str, Any]]:
    exporter = _fitting(to, registry.robot_exporters(), source, "a robot's motion")
    motion = stages.read_table(ReferenceMotion, source)
    content = exporter.write(motion, stages.robot_of(motion).model)
    return content, {"robot": motion.robot, "steps": len(motion)}


def holds_a_person(source: Path) -> bool:
    """Whether a table has SMPL's columns.

    Raises:
        BadTable: it is no Parquet file.
    """
    try:
        return "global_orient" in pq.read_schema(io.BytesIO(source.read_bytes())).names
    except pa.ArrowInvalid as cause:
        raise BadTable(f"{source}: not a Parquet file ({cause})") from cause


def _require_another(source: Path, out: Path) -> None:
    if out.exists() and source.exists() and out.samefile(source):
        raise StoreError(f"{out}: is the motion itself; write the result to another file")


def _fitting(to: str, known: Mapping[str, Exporter], source: Path, what: str) -> Exporter:
    """Return the exporter of that name, of those that write what the file holds."""
    if to not in known:
        raise UnknownName("format", to, f"--to; {source} holds {what}", known)
    return known[to]
