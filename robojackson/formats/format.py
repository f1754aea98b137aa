"""Declarations of a format module: it writes a format (`EXPORT`), reads one (`IMPORT`), or both.

`registry` finds every module with a declaration; no other list exists.
"""

import io
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
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
        write: Function that returns the content of a file.
        fps: Frames a second of its files; None where they have the motion's control steps.
    """

    name: str
    write: Callable[[ReferenceMotion, "MjModel"], bytes]
    fps: float | None = None


@dataclass(frozen=True)
class PersonExporter:
    """A format of human motions; name and function as those of `RobotExporter`."""

    name: str
    write: Callable[[SmplSequence], bytes]


class PolicyNetwork(Protocol):
    """The parts of a policy that exporters write (`rl.policy.Policy` is one).

    Attributes:
        layers: (weight (in, out), bias (out,)); ReLU between them, tanh at the end.
        facts: Metadata of the policy: robot, motion and configuration of its training.
        observation_size: Length of an observation.
    """

    @property
    def layers(self) -> Layers:
        """Weights and biases, first layer first."""

    @property
    def facts(self) -> Mapping[str, object]:
        """Metadata of the policy's training."""

    @property
    def observation_size(self) -> int:
        """Length of an observation."""


@dataclass(frozen=True)
class PolicyExporter:
    """A format of policies; name and function as those of `RobotExporter`."""

    name: str
    write: Callable[[PolicyNetwork], bytes]


@dataclass(frozen=True)
class Content:
    """A file whose format is recognised by its content.

    Attributes:
        data: Bytes of the file.
        where: Name of the file in errors.
    """

    data: bytes
    where: str

    @property
    def head(self) -> bytes:
        """Return the first characters of the file without a byte order mark and blanks."""
        return self.data[:64].removeprefix(BYTE_ORDER_MARK).lstrip()

    @cached_property
    def members(self) -> frozenset[str]:
        """Return the names in a zip without their folders; empty for another file.

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
        """Return the dictionary in a pickle, read without running anything; empty for another file.

        Raises:
            BadTable: a damaged pickle, or one that holds anything but arrays.
        """
        if not self.data.startswith(b"\x80"):
            return {}
        return safe_pickle.load_joblib(self.data, self.where)


@dataclass(frozen=True)
class Importer:
    """A format of human motions that can be read.

    Attributes:
        name: Name of the format.
        read: Function that returns the motion in a file.
        recognises: Function that returns whether a file is of this format.
        fps: Frames a second where a file has none; None where the file must have it.
    """

    name: str
    read: Callable[[bytes], ForeignMotion | HybrikMotion]
    recognises: Callable[[Content], bool]
    fps: float | None = None


@contextmanager
def refusing(where: str) -> Iterator[None]:
    """Turn what the arrays of a foreign file raise into `BadTable`.

    Args:
        where: Kind of the file in errors.
    """
    try:
        yield
    except (KeyError, TypeError, IndexError, ValueError, OverflowError, SyntaxError) as cause:
        raise BadTable(f"{where}: {type(cause).__name__}: {cause}") from cause


Format = RobotExporter | PersonExporter | PolicyExporter | Importer
