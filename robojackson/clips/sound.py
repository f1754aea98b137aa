"""The sound of a clip, and its beats. Seconds since the first picture of the clip."""

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from av.audio.frame import AudioFrame
from av.audio.stream import AudioStream
from av.container import OutputContainer
from jaxtyping import Float

from robojackson.clips.video_container import opened
from robojackson.errors import MissingDependency, UnreadableVideo

RATE = 44_100
"""Samples a second of everything that is heard."""
LONGEST_S = 600.0
"""More of a file is not read, seconds."""
LOWEST_RATE = 1000
"""Samples a second of a file below which nothing is heard."""
SILENT = 1e-4
"""Largest amplitude of an inaudible sound."""


@dataclass(frozen=True, repr=False)
class Sound:
    """Samples at `RATE`, -1..1; the first is heard with the first picture."""

    samples: Float[np.ndarray, "S 2"]

    def __repr__(self) -> str:
        return f"Sound({len(self.samples) / RATE:.1f} s)"


def read_sound(path: Path, start_s: float = 0.0) -> Sound | None:
    """Read the first sound track of a video or of a sound file; None where it has none.

    What follows damage is left out, and so is a sound that begins after `LONGEST_S`
    or has less than `LOWEST_RATE` samples a second.

    Args:
        start_s: Time of the sound's first sample, seconds since the first picture.
    Raises:
        UnreadableVideo: the file cannot be read.
        TruncatedVideo: it ends before its index.
    """
    parts, heard_s, passed = list[np.ndarray](), 0.0, 0
    with opened(path, sounds=True) as container:
        if not container.streams.audio:
            return None
        pictures = container.streams.video
        shift = _start_s(container.streams.audio[0])
        if pictures:
            shift -= _start_s(pictures[0])
        if shift > LONGEST_S or container.streams.audio[0].rate < LOWEST_RATE:  # fills the memory
            return None
        first = round((start_s - shift) * RATE)
        resampler = av.AudioResampler(format="fltp", layout="stereo", rate=RATE)
        try:
            for frame in container.decode(audio=0):
                for part in resampler.resample(frame):
                    if not parts and passed + part.samples <= first:
                        passed += part.samples
                    else:
                        parts.append(part.to_ndarray().T)
                heard_s += frame.samples / max(frame.sample_rate, 1)
                if heard_s > start_s + LONGEST_S:
                    break
            parts += [part.to_ndarray().T for part in resampler.resample(None)]
        except (av.FFmpegError, ValueError):
            pass  # damaged, or the rate changes: heard as far as it goes
    samples = np.concatenate([np.zeros((0, 2), np.float32), *parts])
    del parts
    late = passed - first
    samples = np.pad(samples, ((late, 0), (0, 0))) if late > 0 else samples[-late:]
    np.clip(np.nan_to_num(samples, copy=False), -1, 1, out=samples)
    return Sound(samples) if np.abs(samples).max(initial=0.0) > SILENT else None


def require_sound(path: Path) -> Sound:
    """Read a sound file.

    Raises:
        UnreadableVideo: it has no sound.
    """
    sound = read_sound(path)
    if sound is None:
        raise UnreadableVideo("the file holds no sound that can be heard", path)
    return sound


def require_audible(path: Path) -> None:
    """Raise `UnreadableVideo` for a file without a sound that can be heard."""
    require_sound(path)


def encode_sound(container: OutputContainer, stream: AudioStream, sound: Sound) -> None:
    """Write a sound into a stream of `RATE` and two channels; it begins with the first picture."""
    samples = np.ascontiguousarray(sound.samples.T, np.float32)
    frame = AudioFrame.from_ndarray(samples, format="fltp", layout="stereo")
    frame.sample_rate, frame.pts, frame.time_base = RATE, 0, Fraction(1, RATE)
    container.mux(stream.encode(frame))
    container.mux(stream.encode(None))


def music_beats(sound: Sound) -> Float[np.ndarray, " B"]:
    """Return the times of the beats of a piece of music, seconds.

    Raises:
        MissingDependency: librosa is not installed.
    """
    try:
        import librosa
    except ImportError as cause:
        raise MissingDependency(
            "beats of music need librosa: pip install 'robojackson[music]'"
        ) from cause
    mono = sound.samples.mean(1)
    hop = 256
    strength = librosa.onset.onset_strength(y=mono, sr=RATE, hop_length=hop)
    _, frames = librosa.beat.beat_track(
        onset_envelope=strength, sr=RATE, hop_length=hop, trim=False
    )
    times: np.ndarray = librosa.frames_to_time(frames, sr=RATE, hop_length=hop)
    return times


def _start_s(stream: av.stream.Stream) -> float:
    if stream.start_time is None or stream.time_base is None:
        return 0.0
    return float(stream.start_time * stream.time_base)
