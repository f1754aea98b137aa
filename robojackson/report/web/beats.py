"""Beats of the music and of the dancers in a film: figures, table and rows of a timeline.

Seconds since the first picture of the film.
"""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from robojackson.clips.sound import music_beats, read_sound, require_sound
from robojackson.metrics.beat_alignment import alignment, half_a_beat, motion_beats
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.report.video.soundtrack import clip_times
from robojackson.report.web.player_data import Band, Span

Report = dict[str, Any]
"""The content of `beats.json`."""

GRID_S = 0.005
CONTROL = "control"
TITLES = {
    "person": "dancer",
    "reference": "reference robot",
    "robot": "robot in simulation",
    CONTROL: "control: half a beat later",
}


def music_beats_shown(
    source: Path, music: str, reference: ReferenceMotion, seconds: float
) -> Float[np.ndarray, " B"]:
    """Return the times of the beats in a clip's sound, or in other music; none in silence.

    Raises:
        MissingDependency: librosa is not installed.
        UnreadableVideo: the music has no sound.
    """
    sound = require_sound(Path(music)) if music else read_sound(source)
    if sound is None:
        return np.zeros(0)
    grid = np.arange(0, seconds, GRID_S)
    times = clip_times(reference, grid, goes_on=bool(music))
    heard = [grid[:-1][(times[:-1] <= beat) & (beat < times[1:])] for beat in music_beats(sound)]
    result: np.ndarray = np.unique(np.concatenate([*heard, np.zeros(0)]))
    return result


def pictures_danced(reference: ReferenceMotion, fps: float, count: int) -> Bool[np.ndarray, " T"]:
    """Return in which pictures the clip goes on: not in the stands and steps before and after it,
    which have no music."""
    times = clip_times(reference, np.arange(count + 1) / fps, goes_on=True)
    result: np.ndarray = np.diff(times) > 0
    return result


def beat_report(
    music: Float[np.ndarray, " B"],
    motions: dict[str, Float[np.ndarray, "T K 3"]],
    fps: float,
    danced: Bool[np.ndarray, " T"],
) -> Report:
    """Return beats and figures of the motions, and of the last of them half a beat later.

    Args:
        danced: In which pictures the clip goes on; beats of others do not count.
    """

    def counted(times: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
        pictures = np.round(fps * times).astype(int)
        counts = (pictures < len(danced)) & danced[np.minimum(pictures, len(danced) - 1)]
        result: np.ndarray = times[counts]
        return result

    beats = {name: counted(motion_beats(points, fps)) for name, points in motions.items()}
    last = list(beats)[-1]
    compared = {**beats, CONTROL: counted(beats[last] + half_a_beat(music))}
    return {
        "music": music.round(3).tolist(),
        "motions": {name: times.round(3).tolist() for name, times in beats.items()},
        "figures": {name: asdict(alignment(music, times)) for name, times in compared.items()},
        "control_of": last,
    }


def beat_bands(report: Report, fps: float) -> list[Band]:
    """Return the rows of the timeline that show the beats."""
    rows = {"music": report["music"], **report["motions"]}
    return [
        Band(
            "beats of the music" if name == "music" else f"beats, {TITLES[name]}",
            [
                Span(
                    fps * time - 0.6,
                    fps * time + 0.6,
                    "music" if name == "music" else "beat",
                    "beat",
                )
                for time in times
            ],
        )
        for name, times in rows.items()
        if times
    ]
