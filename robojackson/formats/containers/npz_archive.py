"""Arrays by name in a NumPy archive, in memory; nothing in it is ever unpickled."""

import io
import math
import zipfile
import zlib
from collections.abc import Collection, Iterable, Mapping

import numpy as np
from numpy.lib import format as npy

from robojackson.errors import BadTable

ZIP_FAILURES = (
    *(zipfile.BadZipFile, zlib.error, OSError, EOFError),
    *(ValueError, TypeError, KeyError, NotImplementedError, RuntimeError),
)
"""What `zipfile` raises on a damaged file."""
MAX_LISTED = 12
"""Names of arrays in a message."""
MOST_BYTES = 2**29
"""Of one array: ten minutes of AMASS at 120 frames a second have 90 MB."""


def pack(arrays: Mapping[str, np.ndarray]) -> bytes:
    """An uncompressed .npz."""
    sink = io.BytesIO()
    np.savez(sink, allow_pickle=False, **arrays)
    return sink.getvalue()


def unpack(
    data: bytes, needed: Iterable[str], where: str, requested: Collection[str] | None = None
) -> dict[str, np.ndarray]:
    """The arrays of an .npz.

    Args:
        data: Of the file.
        needed: Names that must be there.
        where: For the message.
        requested: Names that are read; None reads all. The others may hold anything.

    Raises:
        BadTable: no .npz, one that holds Python objects, or a needed array is missing.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            found = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
            chosen = [name for name in found if requested is None or name in requested]
            arrays = {name: _member(archive, found[name]) for name in chosen}
    except ZIP_FAILURES as cause:
        raise BadTable(f"{where}: not an .npz of plain arrays ({cause})") from cause
    known = ", ".join(list(found)[:MAX_LISTED])
    for name in needed:
        if name not in arrays:
            raise BadTable(f"{where}: array {name!r} is missing. It has: {known}")
    return arrays


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    """One array; its header must promise exactly the bytes that are there."""
    if info.file_size > MOST_BYTES:
        raise ValueError(f"{info.filename}: {info.file_size} bytes, at most {MOST_BYTES} are read")
    source = io.BytesIO(archive.read(info))
    version = npy.read_magic(source)
    read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, fortran, kind = read_header(source)
    if kind.hasobject:
        raise ValueError(f"{info.filename}: holds Python objects")
    rest = source.getbuffer().nbytes - source.tell()
    if math.prod(shape) * kind.itemsize != rest:
        raise ValueError(f"{info.filename}: {shape} of {kind} promised, {rest} bytes are there")
    flat = np.frombuffer(source.read(), kind).copy()
    return flat.reshape(shape, order="F" if fortran else "C")
