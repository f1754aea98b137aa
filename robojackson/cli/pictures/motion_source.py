"""The file that a motion comes from: source.json, written by `robojackson mocap` and `import`."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from robojackson.errors import RoboJacksonError
from robojackson.files.foreign_file import read_json
from robojackson.files.local_folder import sha256_of_file
from robojackson.motion.landmark_track import LandmarkTrack

FILE, LANDMARKS = "source.json", "landmarks.parquet"


@dataclass(frozen=True)
class MotionSource:
    """The clip of a motion.

    Attributes:
        video: The file.
        track: The landmarks found in it.
    """

    video: Path
    track: LandmarkTrack


def source_record(
    video: Path, landmarks: bytes, motions: Mapping[str, bytes], whole: Path | None = None
) -> bytes:
    """Return the content of source.json.

    Args:
        whole: The video of which `video` is a range, if it is: its licence is beside it.
        landmarks: Content of landmarks.parquet.
        motions: Content of the motions' files by name.
    """
    facts = {
        "video": str(video.absolute()),
        "bytes": video.stat().st_size,
        "landmarks": hashlib.sha256(landmarks).hexdigest(),
        "motions": {name: hashlib.sha256(data).hexdigest() for name, data in motions.items()},
    }
    if whole is not None and whole.absolute() != video.absolute():
        facts["range_of"] = str(whole.absolute())
    return json.dumps(facts, indent=1).encode()


def import_record(file: Path, layout: str) -> bytes:
    """Return the content of source.json of an imported motion.

    Args:
        layout: Name of the file's format.
    """
    facts = {
        "imported": str(file.absolute()),
        "format": layout,
        "sha256": sha256_of_file(file),
    }
    return json.dumps(facts, indent=1).encode()


def source_of(smpl: Path) -> MotionSource | None:
    """Return the clip of a motion, None where it is unknown, missing, or changed."""
    try:
        facts = read_json(smpl.parent / FILE)
        video = Path(facts["video"])
        landmarks = smpl.parent / LANDMARKS
        same = (
            facts["motions"].get(smpl.name) == sha256_of_file(smpl)
            and facts["landmarks"] == sha256_of_file(landmarks)
            and facts["bytes"] == video.stat().st_size
        )
    except (RoboJacksonError, OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return MotionSource(video, LandmarkTrack.load(landmarks)) if same else None
