"""A performance by the regulator is announced before its search begins; one by a network is not."""

import logging
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from robojackson.api import performances
from robojackson.pipeline.tracker_descriptions import describe_tracker
from robojackson.rl.trackers.regulator_tracker import RegulatorTracker
from robojackson.rl.trackers.tracker import Tracker
from robojackson.rl.trackers.twist2 import Twist2Tracker
from tests.fixtures.robots import robot_motion
from tests.fixtures.stand_in_tracker import stand_in


class Begun(Exception):
    """The performance itself has begun."""


def lines_before(
    tracker: Tracker, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> list[str]:
    """Return the warnings of a performance before a robot moves."""

    def begin(*given: object) -> None:
        raise Begun

    motion = robot_motion("hip_shake")
    monkeypatch.setattr(performances, "plan", lambda *given: SimpleNamespace(motion=motion))
    monkeypatch.setattr(performances.performance, "perform", begin)
    with caplog.at_level(logging.WARNING), pytest.raises(Begun):
        performances.perform([motion], "humanoid", tracker=tracker)
    return [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]


def test_the_regulator_s_search_is_announced_in_one_line(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    regulator = RegulatorTracker(replace(describe_tracker("regulator"), robot="humanoid"))
    (line,) = lines_before(regulator, monkeypatch, caplog)
    assert line.startswith("regulator computes gains for all ")
    assert "minutes of a processor" in line
    assert "\n" not in line


def test_a_network_needs_no_search(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, tmp_path: Path
) -> None:
    file, description = stand_in(tmp_path)
    assert lines_before(Twist2Tracker(description, file), monkeypatch, caplog) == []
