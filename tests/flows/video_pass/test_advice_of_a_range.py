"""Advice about a part of a video gives moments of the video, for `--start` and `--end`."""

from pathlib import Path

import numpy as np
import pytest

from flows.video_pass import dance_stages
from robojackson.errors import RejectedReference
from robojackson.motion.landmark_track import LandmarkTrack
from storage import artifact_tables
from storage.store import Store

FRAMES = 150


def seen_from_the_first_second_on() -> LandmarkTrack:
    """Return five seconds of one person who is missing in the first."""
    landmarks = np.random.default_rng(4).uniform(0.3, 0.7, (FRAMES, 33, 3))
    landmarks[:, 0, 1], landmarks[:, 28, 1] = 0.15, 0.85
    landmarks[:30] = np.nan
    return LandmarkTrack(30.0, 640, 480, landmarks, landmarks, np.ones((FRAMES, 33)))


def test_a_refused_motion_names_a_range_of_the_video(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(scorecard: object) -> None:
        raise RejectedReference("reference refused: infeasible", "choose another clip")

    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path))
    monkeypatch.setattr(dance_stages, "check", refuse)
    store, track = Store.from_environment(), seen_from_the_first_second_on()
    moved = {
        "landmarks": artifact_tables.save(store, "landmarks", "landmarks.parquet", track),
        "scorecard": store.save("scorecard", "scorecard.json", b"{}"),
    }
    with pytest.raises(RejectedReference, match=r"in sight from 3\.0 to 7\.0 s"):
        dance_stages._require_feasible(moved, 2.0)
