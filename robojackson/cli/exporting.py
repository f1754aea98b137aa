"""A motion in the file format of another project, from file to file, with no Prefect.

What the file holds decides which formats fit: a robot's reference motion or a person's motion.
"""

import io
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq

from robojackson.cli import stages
from robojackson.errors import BadTable, StoreError, UnknownName
from robojackson.formats import (
    amass,
    beyondmimic,
    bvh,
    gmr,
    gvhmr,
    keyframes,
    locomujoco,
    omniretarget,
    smpl_csv,
    unitree_csv,
)
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.file_tree import FileTree

if TYPE_CHECKING:
    from mujoco import MjModel

FORMATS: Mapping[str, Callable[[ReferenceMotion, "MjModel"], bytes]] = {
    "gmr": gmr.write,
    "csv": lambda reference, _: unitree_csv.write(reference),
    "beyondmimic": beyondmimic.write,
    "locomujoco": locomujoco.write,
    "omniretarget": lambda reference, _: omniretarget.write(reference),
    "keyframes": lambda reference, _: keyframes.write(reference),
}
"""Of a robot's motion."""
HUMAN_FORMATS: Mapping[str, Callable[[SmplSequence], bytes]] = {
    "amass": amass.write,
    "bvh": bvh.write,
    "gvhmr": gvhmr.write,
    "csv": smpl_csv.write,
}
"""Of a person's motion."""
POLICY_SUFFIX = ".safetensors"


def export(source: Path, to: str, out: Path) -> dict[str, Any]:
    """Write a robot's or a person's motion as `to`.

    Raises:
        UnknownName: no such format, or none for what the file holds.
        RejectedReference: the robot's model has changed since the motion was made.
        StoreError: the file cannot be read, or the result not written.
    """
    began = time.monotonic()
    _require_another(source, out)
    motion: ReferenceMotion | SmplSequence
    if holds_a_person(source):
        _require(to, HUMAN_FORMATS, source, "a person's motion")
        motion = stages.read_table(SmplSequence, source)
        content = HUMAN_FORMATS[to](motion)
        about: dict[str, Any] = {"frames": len(motion), "fps": motion.fps}
    else:
        _require(to, FORMATS, source, "a robot's motion")
        motion = stages.read_table(ReferenceMotion, source)
        content = FORMATS[to](motion, stages.robot_of(motion).model)
        about = {"robot": motion.robot, "steps": len(motion)}
    files = FileTree(out.parent)
    files.require_writable()
    files.write(out.name, content)
    told = {"file": str(out), "format": to, **about, "bytes": len(content)}
    return told | {"seconds": time.monotonic() - began}


def export_policy(source: Path, out: Path) -> dict[str, Any]:
    """Write a policy.safetensors as ONNX.

    Raises:
        BadPolicy: it is no policy file of ours.
        MissingDependency: the onnx package is not installed.
        StoreError: the result cannot be written.
    """
    _require_another(source, out)
    from robojackson.formats.onnx_policy import to_onnx
    from robojackson.rl.policy import load_policy

    policy = load_policy(source)
    content = to_onnx(policy)
    files = FileTree(out.parent)
    files.require_writable()
    files.write(out.name, content)
    sizes = {"observations": policy.observation_size, "actions": len(policy.layers[-1][1])}
    return {"file": str(out), "format": "onnx", **sizes, "bytes": len(content)}


def holds_a_person(source: Path) -> bool:
    """Whether a table has SMPL's columns.

    Raises:
        StoreError: there is no such file.
        BadTable: it is no Parquet file.
    """
    stages.require_file(source)
    if source.suffix == POLICY_SUFFIX:
        raise BadTable(f"{source}: a policy and no motion; its format is `--to onnx`")
    try:
        return "global_orient" in pq.read_schema(io.BytesIO(source.read_bytes())).names
    except pa.ArrowInvalid as cause:
        raise BadTable(f"{source}: not a Parquet file ({cause})") from cause


def _require_another(source: Path, out: Path) -> None:
    if out.exists() and source.exists() and out.samefile(source):
        raise StoreError(f"{out}: is the motion itself; write the result to another file")


def _require(to: str, fitting: Mapping[str, object], source: Path, what: str) -> None:
    if to not in fitting:
        raise UnknownName("format", to, f"--to; {source} holds {what}", fitting)
