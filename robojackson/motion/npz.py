"""Arrays by name in a NumPy archive, in memory; nothing in it is ever unpickled."""

import io
import zipfile
from collections.abc import Iterable, Mapping

import numpy as np

from robojackson.errors import BadTable


def pack(arrays: Mapping[str, np.ndarray]) -> bytes:
    """An uncompressed .npz."""
    sink = io.BytesIO()
    np.savez(sink, allow_pickle=False, **arrays)
    return sink.getvalue()


def unpack(data: bytes, needed: Iterable[str], where: str) -> dict[str, np.ndarray]:
    """The arrays of an .npz.

    Raises:
        BadTable: no .npz, one that holds Python objects, or a needed array is missing.
    """
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except (ValueError, TypeError, OSError, EOFError, zipfile.BadZipFile) as cause:
        raise BadTable(f"{where}: not an .npz of plain arrays ({cause})") from cause
    for name in needed:
        if name not in arrays:
            raise BadTable(f"{where}: array {name!r} is missing. It has: {', '.join(arrays)}")
    return arrays
