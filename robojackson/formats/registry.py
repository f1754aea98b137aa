"""Which project's file this is, by what is in it; suffixes are not asked."""

import io
import zipfile
from collections.abc import Callable, Mapping

from robojackson.errors import BadTable, UnknownName
from robojackson.formats import aist, amass, bvh, gvhmr, hybrik_output, smpl_csv
from robojackson.formats.containers import safe_pickle
from robojackson.formats.containers.npz_archive import ZIP_FAILURES
from robojackson.formats.foreign_motion import ForeignMotion
from robojackson.formats.hybrik_output import HybrikMotion

READERS: Mapping[str, Callable[[bytes], ForeignMotion | HybrikMotion]] = {
    "aist": aist.read,
    "amass": amass.read,
    "bvh": bvh.read,
    "csv": smpl_csv.read,
    "gvhmr": gvhmr.read,
    "hybrik": hybrik_output.read,
}
RATES: Mapping[str, float] = {"gvhmr": gvhmr.FPS, "hybrik": 30.0}
"""Frames a second where a file does not say: those of GVHMR's demo, and of most videos."""

KNOWN_TO_FAIL: Mapping[bytes, str] = {
    b"": "empty",
    b"PAR1": "a Parquet table; smpl.parquet is what `robojackson retarget` takes",
    b"\x80\x02\x8a\nl\xfc\x9cF\xf9 j\xa8P\x19.": "from before PyTorch 1.6; save it again",
    b"\x78": "compressed; write it again with joblib.dump and compress=0",
    b"\x1f\x8b": "compressed with gzip; unpack it first",
}
"""Beginnings of files that cannot be read, and what to do."""


def recognise(data: bytes, where: str) -> str:
    """The name of a reader.

    Raises:
        UnknownName: none of them.
        BadTable: a pickle that asks for anything but arrays, or a damaged file.
    """
    for start, cause in KNOWN_TO_FAIL.items():
        if data.startswith(start) and (start or not data):
            raise BadTable(f"{where}: {cause}")
    head = data[:64].removeprefix(b"\xef\xbb\xbf").lstrip()
    if head.startswith(b"HIERARCHY"):
        return "bvh"
    if head.startswith(b"time_s,"):
        return "csv"
    if data.startswith(b"PK"):
        members = _members(data, where)
        return "gvhmr" if "data.pkl" in members else "amass"
    if data.startswith(b"\x80"):
        content = safe_pickle.load_joblib(data, where)
        if "smpl_poses" in content:
            return "aist"
        if "pred_xyz_29" in content:
            return "hybrik"
        raise UnknownName("keys of a pickle", ", ".join(content)[:200], where, READERS)
    raise UnknownName("kind of file", data[:16].decode("latin1"), where, READERS)


def _members(data: bytes, where: str) -> set[str]:
    """Names in a zip, without their folders."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return {name.rpartition("/")[2] for name in archive.namelist()}
    except ZIP_FAILURES as cause:
        raise BadTable(f"{where}: cut off or damaged zip ({cause}); copy it again") from cause
