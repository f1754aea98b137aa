"""What a module of this package declares: that it writes a format (`EXPORT`), reads one (`IMPORT`).

`registry` finds every module that declares one; nothing else lists them.
"""

import io
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from robojackson.errors import BadTable
from robojackson.formats.containers import safe_pickle
from robojackson.formats.containers.npz_archive import ZIP_FAILURES
from robojackson.formats.foreign_motion import ForeignMotion, HybrikMotion
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence

if TYPE_CHECKING:
    from mujoco import MjModel

Layers = tuple[tuple[np.ndarray, np.ndarray], ...]
BYTE_ORDER_MARK = b"\xef\xbb\xbf"


@dataclass(frozen=True)
class RobotExporter:
    """A format of robot motions.

    Attributes:
        name: Value of `robojackson export --to`.
        write: Returns the content of a file.
    """

    name: str
    write: Callable[[ReferenceMotion, "MjModel"], bytes]


@dataclass(frozen=True)
class PersonExporter:
    """A format of human motions; attributes as those of `RobotExporter`."""

    name: str
    write: Callable[[SmplSequence], bytes]


class PolicyNetwork(Protocol):
    """What is written of a policy (`rl.policy.Policy` is one).

    Attributes:
        layers: (weight (in, out), bias (out,)); ReLU between them, tanh at the end.
        facts: What the policy was trained for.
        observation_size: Length of an observation.
    """

    @property
    def layers(self) -> Layers: ...

    @property
    def facts(self) -> Mapping[str, object]: ...

    @property
    def observation_size(self) -> int: ...


@dataclass(frozen=True)
class PolicyExporter:
    """A format of policies; attributes as those of `RobotExporter`."""

    name: str
    write: Callable[[PolicyNetwork], bytes]


@dataclass(frozen=True)
class Content:
    """A file whose format is to be recognised by what is in it.

    Attributes:
        data: Its bytes.
        where: How errors name it.
    """

    data: bytes
    where: str

    @property
    def head(self) -> bytes:
        """Its first characters, without a byte order mark and blanks."""
        return self.data[:64].removeprefix(BYTE_ORDER_MARK).lstrip()

    @cached_property
    def members(self) -> frozenset[str]:
        """Names in a zip, without their folders; empty for another file.

        Raises:
            BadTable: a damaged zip.
        """
        if not self.data.startswith(b"PK"):
            return frozenset()
        try:
            with zipfile.ZipFile(io.BytesIO(self.data)) as archive:
                return frozenset(name.rpartition("/")[2] for name in archive.namelist())
        except ZIP_FAILURES as cause:
            raise BadTable(
                f"{self.where}: cut off or damaged zip ({cause}); copy it again"
            ) from cause

    @cached_property
    def pickled(self) -> Mapping[str, object]:
        """The dictionary in a pickle, read without running anything; empty for another file.

        Raises:
            BadTable: a pickle that asks for anything but arrays, or a damaged one.
        """
        if not self.data.startswith(b"\x80"):
            return {}
        return safe_pickle.load_joblib(self.data, self.where)


@dataclass(frozen=True)
class Importer:
    """A format of human motions that is read.

    Attributes:
        name: Of the format.
        read: Returns the motion in a file.
        recognises: Whether a file is of this format.
        fps: Frames a second where a file does not say; None where it has to.
    """

    name: str
    read: Callable[[bytes], ForeignMotion | HybrikMotion]
    recognises: Callable[[Content], bool]
    fps: float | None = None


Format = RobotExporter | PersonExporter | PolicyExporter | Importer
