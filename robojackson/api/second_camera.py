"""The same dance from a second camera."""

from pathlib import Path

from robojackson.api.arguments import FilePath, Progress, read_if_path
from robojackson.api.videos import detect_landmarks
from robojackson.clips.sound import read_sound
from robojackson.mocap.landmarks.landmark_pipeline import Quality
from robojackson.mocap.recover import MocapConfig
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence

TABLE = ".parquet"


def recover_with_second(
    track: LandmarkTrack,
    video: FilePath | None,
    second: FilePath | LandmarkTrack,
    config: MocapConfig,
    quality: Quality,
    person: int | None,
    progress: Progress,
) -> SmplSequence:
    """Recover the motion that two cameras see, synchronised by their sounds where both have one.

    Args:
        track: Landmarks in the first clip.
        video: File of the first clip; None where it is not known.
        second: The other clip, or its landmarks.
        config, quality, person, progress: See `recover_motion`.
    """
    from robojackson.mocap.views.two_cameras import recover_together

    if isinstance(second, LandmarkTrack) or Path(second).suffix == TABLE:
        return recover_together(track, read_if_path(LandmarkTrack, second), config)
    other = detect_landmarks(second, quality=quality, person=person, progress=progress)
    heard_s = None if video is None else heard_offset(Path(video), Path(second))
    return recover_together(track, other, config, heard_s)


def heard_offset(video: Path, second: Path) -> float | None:
    """Return when a second clip began in the first by their sounds; None where those do not tell.

    Raises:
        UnreadableVideo, TruncatedVideo: a file cannot be read.
    """
    from robojackson.mocap.views.timing import sound_offset

    one, two = read_sound(video), read_sound(second)
    return sound_offset(one, two) if one is not None and two is not None else None
