"""The live page's controls, as its template writes them."""

import re
from dataclasses import replace

import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.report.pages import inline
from robojackson.report.pages.live_page import LEFT_S, last_start
from robojackson.report.web import live_data
from robojackson.rl.policy import Policy
from robojackson.rl.trackers.regulator_tracker import RegulatorTracker
from robojackson.rl.trackers.tracker_description import TrackerDescription
from tests.fixtures.robots import stock

REGULATOR = TrackerDescription(
    name="regulator", robot="humanoid", network="regulator", licence="ours", trained_on="nothing",
    homepage="here", control_dt=0.015, fallback=True,
)  # fmt: skip
CONTROLS = re.compile(r"<(?:input|select)\b[^>]*>")


@pytest.mark.parametrize("page", ["live.html", "page.html"])
def test_no_control_is_restored_by_a_browser(page: str) -> None:
    """After Back it would contradict the physics, or the film."""
    found = CONTROLS.findall(inline.own(page))
    assert len(found) >= 3
    assert [control for control in found if 'autocomplete="off"' not in control] == []


def test_an_open_dance_has_time_left_after_its_last_start(reference: ReferenceMotion) -> None:
    open_dance = replace(reference, cyclic=False, dt=0.1)
    assert (len(open_dance) - 1 - last_start(open_dance)) * 0.1 == pytest.approx(LEFT_S)
    assert last_start(replace(open_dance, dt=0.01)) == 0


def test_a_cyclic_dance_can_start_anywhere(reference: ReferenceMotion) -> None:
    assert last_start(reference) == len(reference) - 1


def test_what_a_browser_cannot_run_has_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, tracker = stock(), RegulatorTracker(REGULATOR)
    assert live_data.why_not_live(tracker, robot) == ""
    assert "another project" in live_data.why_not_live(None, robot)
    assert "paper's mode" in live_data.why_not_live(Policy((), {"mode": "paper"}), robot)
    monkeypatch.setattr(live_data, "_has_colliding_meshes", lambda model: True)
    assert "robot humanoid, whose meshes collide" in live_data.why_not_live(tracker, robot)
