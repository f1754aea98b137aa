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
"""Errors that `zipfile` raises on a damaged file."""
MAX_LISTED = 12
"""Number of array names in a message."""
MOST_NUMBERS = 2**25
"""Largest number of values in all arrays that are read: ten minutes of AMASS at 120 frames a second
have 13 million."""


def pack(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Return an uncompressed .npz."""
    sink = io.BytesIO()
    np.savez(sink, allow_pickle=False, **arrays)
    return sink.getvalue()


def unpack(
    data: bytes, needed: Iterable[str], where: str, requested: Collection[str] | None = None
) -> dict[str, np.ndarray]:
    """Return the arrays of an .npz.

    Args:
        data: Bytes of the file.
        needed: Names of required arrays.
        where: Name of the file in errors.
        requested: Names to read; None reads all. The others may hold anything.

    Raises:
        BadTable: not an .npz, one that holds Python objects, or a required array is missing.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            found = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
            chosen = [name for name in found if requested is None or name in requested]
            arrays: dict[str, np.ndarray] = {}
            for name in chosen:
                left = MOST_NUMBERS - sum(array.size for array in arrays.values())
                arrays[name] = _member(archive, found[name], left)
    except ZIP_FAILURES as cause:
        raise BadTable(f"{where}: not an .npz of plain arrays ({cause})") from cause
    known = ", ".join(list(found)[:MAX_LISTED])
    for name in needed:
        if name not in arrays:
            raise BadTable(f"{where}: array {name!r} is missing. It has: {known}")
    return arrays


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo, most: int) -> np.ndarray:
    """Return one array of at most `most` numbers; its header must match the number of bytes."""
    with archive.open(info) as source:
        version = npy.read_magic(source)
        read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, fortran, kind = read_header(source)
        size, there = math.prod(shape), info.file_size - source.tell()
        if kind.hasobject:
            raise ValueError(f"{info.filename}: holds Python objects")
        if size * kind.itemsize != there:
            raise ValueError(f"{info.filename}: {shape} of {kind} declared, {there} bytes found")
        if size > most or there > 8 * MOST_NUMBERS:
            raise ValueError(
                f"{info.filename}: {size:,} numbers; at most {MOST_NUMBERS:,} are read"
            )
        content = source.read(there)
    flat = np.frombuffer(content, kind).copy()
    return flat.reshape(shape, order="F" if fortran else "C")
