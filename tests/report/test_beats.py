"""Beats count where the clip goes on: stands and steps around a dance have no music."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.metrics.beat_alignment import motion_beats
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.report.web.beats import beat_report, pictures_danced
from tests.fixtures.robots import robot_motion

FPS = 30.0


def motion(cyclic: bool) -> ReferenceMotion:
    """Return a motion of 7 s that stands for 2 s, goes on with its clip for 3 s and stands."""
    found = robot_motion("dance_b")
    time = np.linspace(0.0, 7.0, len(found), endpoint=False)
    source = time if cyclic else np.clip(time - 2.0, 0.0, 3.0)
    return replace(found, dt=7.0 / len(found), cyclic=cyclic, source_time_s=source)


def test_a_dance_goes_on_between_its_stands() -> None:
    danced = pictures_danced(motion(cyclic=False), FPS, 210)
    assert np.flatnonzero(danced)[[0, -1]] == pytest.approx([2 * FPS, 5 * FPS], abs=1)
    assert pictures_danced(motion(cyclic=True), FPS, 210).all()


def test_beats_of_stands_do_not_count() -> None:
    time = np.arange(0.0, 7.0, 1 / FPS)
    points = np.zeros((len(time), 2, 3))
    points[:, 0, 0] = 0.2 * np.sin(2 * np.pi * time)  # moves all the time
    every = motion_beats(points, FPS)
    danced = pictures_danced(motion(cyclic=False), FPS, len(time))
    found = beat_report(every[(every > 2.1) & (every < 4.9)], {"robot": points}, FPS, danced)
    assert 3 <= len(found["motions"]["robot"]) < len(every)
    assert found["figures"]["robot"]["precision"] == 1.0
    assert found["figures"]["robot"]["f1"] == 1.0
