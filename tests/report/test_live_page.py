"""The live page's controls, as its template writes them."""

import base64
import re
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.report.pages import inline
from robojackson.report.pages.live_page import LEFT_S, last_start
from robojackson.report.web import live_data
from robojackson.report.web.live_model import live_model
from robojackson.rl.policy import Policy
from robojackson.rl.trackers.regulator_tracker import RegulatorTracker
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.model import Robot, load_robot
from tests.fixtures.own_robot import BY_PAIRS, UNTOUCHED, described_on
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


FITTED = (
    (
        "<asset>",
        '<asset><mesh name="block" vertex="-.1 -.05 -.03 .1 -.05 -.03 .1 .05 -.03 -.1 .05 -.03 '
        '-.1 -.05 .03 .1 -.05 .03 .1 .05 .03 -.1 .05 .03"/>',
    ),
    (
        '<geom name="head"',
        '<geom type="box" mesh="block" pos="-.15 0 -.05" euler="0 0 30" mass=".3"/>'
        '<geom type="mesh" mesh="block" pos=".2 0 0" mass=".1" contype="0" conaffinity="0"/>'
        '<geom name="head"',
    ),
    ("<worldbody>", f'<worldbody><geom type="mesh" mesh="block" {UNTOUCHED}/>'),
)


@pytest.mark.parametrize("changes", [BY_PAIRS, FITTED, ()])
def test_a_browser_gets_everything_that_touches(
    changes: tuple[tuple[str, str], ...], tmp_path: Path
) -> None:
    """With the numbers beside its text the model moves as the robot does."""
    robot = load_robot(described_on(tmp_path, *changes))
    xml, numbers = live_model(robot)
    read = mujoco.MjModel.from_xml_string(xml)
    for name, text in numbers.items():
        array = getattr(read, name)
        array[:] = np.frombuffer(base64.b64decode(text)).reshape(array.shape)
    assert read.npair == robot.model.npair
    poses = [np.zeros(0), np.zeros(0)]
    for index, model in enumerate((read, robot.model)):
        data = mujoco.MjData(model)
        data.qpos[:] = robot.standing
        data.qpos[3] = 0.9
        for _ in range(300):
            mujoco.mj_step(model, data)
        assert data.ncon
        poses[index] = data.qpos.copy()
    np.testing.assert_allclose(*poses, atol=1e-9)


def test_a_model_that_mujoco_cannot_write_for_a_browser_has_a_reason(
    monkeypatch: pytest.MonkeyPatch, reference: ReferenceMotion
) -> None:
    def refuse(robot: Robot) -> None:
        raise ValueError("Error: mesh 'x' not found\nElement 'geom'")

    monkeypatch.setattr(live_data, "live_model", refuse)
    tracker = RegulatorTracker(REGULATOR)
    assert live_data.why_not_live(tracker, stock()).startswith(
        "a browser cannot run robot humanoid: Error: mesh 'x' not found"
    )
    assert live_data.live_data(tracker, reference, stock()) is None
