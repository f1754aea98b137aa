"""A reference motion in the file format of another project, from file to file, with no Prefect."""

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flows import single
from robojackson.errors import UnknownName
from robojackson.motion import beyondmimic, gmr, keyframes, locomujoco, omniretarget, unitree
from robojackson.motion.reference import ReferenceMotion
from storage.store import Store

if TYPE_CHECKING:
    from mujoco import MjModel

FORMATS: Mapping[str, Callable[[ReferenceMotion, "MjModel"], bytes]] = {
    "gmr": gmr.write,
    "csv": lambda reference, _: unitree.write(reference),
    "beyondmimic": beyondmimic.write,
    "locomujoco": locomujoco.write,
    "omniretarget": lambda reference, _: omniretarget.write(reference),
    "keyframes": lambda reference, _: keyframes.write(reference),
}


def export(reference: Path, to: str, out: Path) -> dict[str, Any]:
    """Write a reference motion as `to`, one of FORMATS.

    Raises:
        UnknownName: no such format.
        RejectedReference: the robot's model has changed since the motion was made.
        StoreError: the reference cannot be read, or the file not written.
    """
    if to not in FORMATS:
        raise UnknownName("format", to, "--to", FORMATS)
    began = time.monotonic()
    motion = single.read_table(ReferenceMotion, reference)
    content = FORMATS[to](motion, single.robot_of(motion).model)
    store = Store(out.parent)
    store.require_writable()
    store.put(out.name, content)
    return {
        "file": str(out),
        "format": to,
        "robot": motion.robot,
        "steps": len(motion),
        "bytes": len(content),
        "seconds": time.monotonic() - began,
    }
