"""The live dance in Debian's chromium: the same physics as Python's, and it can be disturbed."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from robojackson.report.web.live_records import RECORDS
from robojackson.report.web.shown_run import RecordedRun
from robojackson.rl.evaluation.controllers import control_of, trained_driver
from robojackson.rl.evaluation.rollouts import Starts, roll_out
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.reference_clip import Clip
from robojackson.robot.fall import Fall
from tests.browser.conftest import WITHOUT_3D, Opened, beside_pelvis
from tests.browser.test_run_page import serious

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = [pytest.mark.browser, pytest.mark.timeout(900)]
Open = Callable[..., Opened]
STEPS = 120
PAUSE = "() => { robojackson.state.playing = false }"
ROLLOUTS = """steps => { const { dancer, dance } = robojackson; robojackson.state.playing = false;
  return dance.records.map((record) => {
    dancer.start(record.step, { qpos: Float64Array.from(record.qpos), qvel: Float64Array.from(record.qvel) });
    let error = 0, count = 0;
    for (let k = 0; k < steps; k++) { if (!dancer.advance()) break; error += dancer.error; count += 1; }
    return [dancer.danced, error / Math.max(1, count)];
  }); }"""  # noqa: E501

FELL = """() => { const { dancer, view, show } = robojackson, [pane] = view.panes, place = new THREE.Vector3();
  dancer.mode = 'statue'; dancer.start(0); dancer.push(0.8, 0);
  for (let k = 0; k < 400; k++) { dancer.advance(); show(); }
  view.aim(pane); pane.camera.updateMatrixWorld();
  const at = Array.from(dancer.data.xpos);
  let most = 0;
  for (let b = 3; b < at.length; b += 3) most = Math.max(most, ...place.set(...at.slice(b, b + 3)).project(pane.camera).toArray().slice(0, 2).map(Math.abs));
  return most; }"""  # noqa: E501
"""How far a fallen robot's bodies are from the middle of the pane; 1 is the edge."""
CHECKED = "[data-checked=yes]"
PHONE = {"has_touch": True, "is_mobile": True}
SET = """([id, value]) => { const slider = document.getElementById(id); slider.value = value;
  slider.dispatchEvent(new Event('input')); }"""
STATE = """() => { const { dancer, state } = robojackson, of = (id) => document.getElementById(id).value;
  return { mode: [of('mode'), dancer.mode], speed: [Number(of('speed')), state.speed], start: [Number(of('phase')), dancer.first],
    friction: [Number(of('friction')), dancer.model.geom_friction[0] / dancer.friction[0]] }; }"""  # noqa: E501
"""What each control shows, and what holds."""
ASIDE = """() => { const { dancer } = robojackson;
  return [[0, 0], [1, 0], [0.6, 0.8]].map(([along, turn]) => {
    const state = dancer.state(0), [w, x, y, z] = state.qpos.slice(3, 7), c = Math.cos(turn / 2), s = Math.sin(turn / 2);
    state.qpos[0] += along; state.qpos.set([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w], 3);
    dancer.mode = 'statue'; dancer.start(0, state); dancer.advance(); return dancer.error; }); }"""  # noqa: E501
"""Errors of a robot in its place, 1 m aside, and aside and turned."""
ROOT_ON_SCREEN = """() => { const { dancer, view } = robojackson, [pane] = view.panes, at = dancer.data.xpos;
  view.aim(pane); pane.camera.updateMatrixWorld();
  const place = new THREE.Vector3(at[3], at[4], at[5]).project(pane.camera), box = pane.element.getBoundingClientRect();
  return [box.left + (place.x + 1) / 2 * box.width, box.top + (1 - place.y) / 2 * box.height]; }"""  # noqa: E501
DRAGGED_AND_PUSHED = """speed => { const { dancer, dance, drag, held } = robojackson;
  const mass = dancer.model.body_subtreemass[1], impulse = [0, 0];
  const roll = (act) => { dancer.start(0);
    for (let k = 0; k < 12; k++) { act(k); dancer.advance(); }
    dancer.mujoco.mj_forward(dancer.model, dancer.data); return Array.from(dancer.data.subtree_com).slice(3, 5); };
  const size = () => Math.hypot(...impulse) / mass, force = dancer.data.xfrc_applied;
  let steps = 0;
  const plain = roll(() => {});
  const dragged = roll((k) => { force.fill(0);
    if (size() < speed) { drag(); steps = k + 1; [0, 1].forEach((i) => { impulse[i] += force[6 * held.body + i] * dance.dt; }); } });
  const pushed = roll((k) => { force.fill(0); if (k === Math.floor(steps / 2)) dancer.push(impulse[0] / mass, impulse[1] / mass); });
  const apart = (a) => Math.hypot(a[0] - plain[0], a[1] - plain[1]);
  return { steps, impulse: impulse.map((value) => value / mass), dragged: apart(dragged), pushed: apart(pushed) }; }"""  # noqa: E501


def test_live_page_requests_nothing_and_fits(opened: Open, live_file: Path) -> None:
    found = opened(live_file, 375, "dark")
    found.page.wait_for_selector("[data-checked=yes]")
    assert [url for url in found.requests if not url.startswith("blob:")] == [live_file.as_uri()]
    assert found.complaints == []
    assert found.page.evaluate("document.documentElement.scrollWidth") <= 375
    assert "physics as in Python" in found.page.inner_text("#badge")
    assert live_file.stat().st_size <= 6_000_000


def test_every_recorded_state_ends_within_5_mm_of_python(opened: Open, live_file: Path) -> None:
    page = opened(live_file).page
    page.evaluate(PAUSE)
    apart = page.evaluate("robojackson.dance.records.map((r) => robojackson.dancer.deviation(r))")
    assert len(apart) == RECORDS
    assert max(apart) <= 5.0


def test_the_badge_reports_physics_that_differs(opened: Open, live_file: Path) -> None:
    page = opened(live_file).page
    page.wait_for_selector("[data-checked=yes]")
    page.evaluate(PAUSE)
    page.evaluate("() => { robojackson.dancer.setFriction(0.01); robojackson.check(4); }")
    assert "physics differs from Python's" in page.inner_text("#badge")
    assert page.get_attribute("#badge", "class") == "badge bad"


def test_a_drag_moves_the_robot_as_far_as_a_push_of_the_same_impulse(
    opened: Open, live_file: Path
) -> None:
    page = opened(live_file).page
    page.wait_for_selector("[data-checked=yes]")
    page.evaluate(PAUSE)
    page.evaluate("robojackson.again()")
    page.wait_for_timeout(500)
    x, y = page.evaluate(ROOT_ON_SCREEN)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 300, y, steps=5)
    moved = page.evaluate(DRAGGED_AND_PUSHED, 0.3)
    page.mouse.up()
    assert not page.evaluate("robojackson.dancer.data.xfrc_applied.some((force) => force !== 0)")
    assert np.linalg.norm(moved["impulse"]) == pytest.approx(0.3, abs=0.1)
    assert moved["dragged"] > 0.01
    assert moved["dragged"] == pytest.approx(moved["pushed"], rel=0.25)


def swiped(page: "Page", x: float, y: float) -> list[str]:
    """Swipe upwards with one finger; return the pointer's events before the finger leaves."""
    page.evaluate("""() => { scrollTo(0, 0); window.events = [];
      for (const kind of ['pointerdown', 'pointermove', 'pointercancel']) document.getElementById('orbit').addEventListener(kind, () => events.push(kind), { capture: true }); }""")  # noqa: E501
    finger = page.context.new_cdp_session(page)
    for kind, k in (("touchStart", 0), *(("touchMove", k) for k in range(1, 9))):
        points = [{"x": x, "y": y - 15 * k}]
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        page.wait_for_timeout(30)
    events: list[str] = page.evaluate("events")
    finger.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    page.wait_for_timeout(300)
    return events


def test_a_finger_pulls_the_robot_and_scrolls_beside_it(opened: Open, live_file: Path) -> None:
    page = opened(live_file, 390, **PHONE).page
    page.wait_for_selector(CHECKED)
    page.evaluate(PAUSE)
    page.evaluate("robojackson.again()")
    page.evaluate("() => { document.querySelector('main').style.minHeight = '3000px'; }")
    page.wait_for_timeout(500)
    x, y = page.evaluate(ROOT_ON_SCREEN)
    pulled = swiped(page, x, y)
    assert "pointercancel" not in pulled
    assert pulled.count("pointermove") > 4
    assert page.evaluate("scrollY") == 0
    swiped(page, x - 150, y)
    assert page.evaluate("scrollY") > 20


def test_rollouts_survive_and_err_as_in_python(
    opened: Open, live_file: Path, run: RecordedRun
) -> None:
    page = opened(live_file).page
    theirs = np.array(page.evaluate(ROLLOUTS, STEPS))
    records = page.evaluate("robojackson.dance.records")
    assert run.policy is not None
    clip = Clip(run.reference, lead_of(run.robot, run.reference, control_of(run.policy, run.robot)))
    starts = Starts(*(np.array([one[k] for one in records]) for k in ("step", "qpos", "qvel")))
    driver = trained_driver(run.policy, run.robot, run.reference)
    horizon = np.full(len(records), STEPS)
    done = roll_out(run.robot, clip, driver, starts, horizon, 1, Fall.of(run.robot))
    ours = done.length.astype(float)
    assert abs(theirs[:, 0].mean() - ours.mean()) <= max(1.0, ours.std())
    apart = beside_pelvis(run.robot, done)
    errors = np.array([apart[: max(1, n), i].mean() for i, n in enumerate(done.length)])
    assert abs(theirs[:, 1].mean() - errors.mean()) <= max(0.001, errors.std())


def test_a_push_gravity_and_floor_change_what_happens(opened: Open, live_file: Path) -> None:
    page = opened(live_file).page
    page.evaluate(PAUSE)
    after = {
        name: page.evaluate(
            f"() => {{ const {{ dancer }} = robojackson; dancer.start(0); {act}; "
            "for (let k = 0; k < 20; k++) dancer.advance(); "
            "const at = Array.from(dancer.data.qpos).slice(0, 3);"
            " dancer.setGravity(1); dancer.setFriction(1); return at; }"
        )
        for name, act in {
            "plain": "",
            "pushed": "dancer.push(0.3, 0)",
            "light": "dancer.setGravity(0.1)",
            "slippery": "dancer.setFriction(0.05)",
        }.items()
    }
    assert after["pushed"][0] - after["plain"][0] > 0.02
    assert after["light"] != after["plain"] != after["slippery"]


def test_policy_off_and_statue_are_other_dancers(opened: Open, live_file: Path) -> None:
    page = opened(live_file).page
    page.evaluate(PAUSE)
    script = """mode => { const { dancer } = robojackson; dancer.mode = mode; dancer.start(0);
      for (let k = 0; k < 20; k++) dancer.advance(); return Array.from(dancer.data.qpos); }"""
    ends = [page.evaluate(script, mode) for mode in ("policy", "reference", "statue", "policy")]
    assert ends[0] == ends[3]
    assert ends[0] != ends[1] != ends[2]


def test_a_robot_that_fell_is_in_view_and_can_start_again(opened: Open, live_file: Path) -> None:
    page = opened(live_file).page
    page.wait_for_selector("[data-checked=yes]")
    page.evaluate(PAUSE)
    assert page.evaluate(FELL) < 1
    assert "primary" in (page.get_attribute("#again", "class") or "")
    page.click("#again")
    assert page.evaluate("robojackson.dancer.fallen") is False
    assert "primary" not in (page.get_attribute("#again", "class") or "")


def test_axe_finds_nothing_serious_in_a_live_dance(opened: Open, live_file: Path, axe: str) -> None:
    page = opened(live_file).page
    page.evaluate(PAUSE)
    assert serious(page, axe) == []


def test_every_slider_has_its_name_for_a_screen_reader(opened: Open, live_file: Path) -> None:
    page = opened(live_file).page
    for name in ("Speed", "Floor friction", "Gravity", "Push", "Start at"):
        assert page.get_by_role("slider", name=name).count() == 1


def test_keys_pause_switch_the_dancer_and_start_again(opened: Open, live_file: Path) -> None:
    page = opened(live_file).page
    page.wait_for_selector("[data-checked=yes]")
    page.focus("#live")
    for key in (" ", "o", "g", "s"):
        page.keyboard.press(key)
    assert page.evaluate("robojackson.state.playing") is False
    assert page.evaluate("robojackson.dancer.mode") == "reference"
    assert page.get_attribute("#ghost", "aria-pressed") == "true"
    assert page.inner_text("#speed-value") == "0.2×"
    page.keyboard.press("p")
    assert page.evaluate("Math.hypot(...robojackson.dancer.data.qvel.slice(0, 2))") > 0.1
    page.keyboard.press("r")
    assert page.evaluate("robojackson.dancer.danced") == 0


def test_keys_work_before_anything_is_in_focus_and_after_a_click_on_the_robot(
    opened: Open, live_file: Path
) -> None:
    page = opened(live_file, 800, reduced_motion="reduce").page
    page.wait_for_selector(CHECKED)
    page.keyboard.press("o")
    assert page.evaluate("robojackson.dancer.mode") == "reference"
    page.focus("#friction")
    page.evaluate("robojackson.again()")
    page.mouse.click(*page.evaluate(ROOT_ON_SCREEN))
    assert page.evaluate("document.activeElement.id") == "live"
    page.keyboard.press("o")
    assert page.evaluate("robojackson.dancer.mode") == "statue"


def test_a_dance_stands_where_motion_is_to_be_reduced(opened: Open, live_file: Path) -> None:
    page = opened(live_file, 400, reduced_motion="reduce").page
    page.wait_for_selector(CHECKED)
    page.wait_for_timeout(500)
    assert page.inner_text("#play") == "Play"
    assert page.evaluate("[robojackson.state.playing, robojackson.state.steps]") == [False, 0]
    page.click("#play")
    page.wait_for_timeout(500)
    assert page.inner_text("#play") == "Pause"
    assert page.evaluate("robojackson.state.steps") > 0


def test_controls_show_what_holds_after_back(opened: Open, live_file: Path) -> None:
    page = opened(live_file, 400, reduced_motion="reduce").page
    page.wait_for_selector(CHECKED)
    page.select_option("#mode", "statue")
    for id_, value in (("speed", 0.2), ("friction", 0.5), ("phase", 60)):
        page.evaluate(SET, [id_, value])
    page.goto("about:blank")
    page.go_back()
    page.wait_for_selector(CHECKED)
    page.wait_for_timeout(500)
    for shown, holds in page.evaluate(STATE).values():
        assert shown == holds


@pytest.mark.parametrize(
    ("before", "reason"),
    [(WITHOUT_3D, "draws no 3D"), ("delete window.DecompressionStream", "DecompressionStream"),
     ("delete window.WebAssembly", "WebAssembly")],
)  # fmt: skip
def test_the_badge_names_what_a_browser_lacks(
    opened: Open, live_file: Path, before: str, reason: str
) -> None:
    page = opened(live_file, 400, before=before).page
    page.wait_for_selector("#badge.bad")
    assert "this browser cannot run the dance" in page.inner_text("#badge")
    assert reason in page.inner_text("#badge")


def test_drift_over_the_floor_is_no_error(opened: Open, live_file: Path) -> None:
    page = opened(live_file, 400, reduced_motion="reduce").page
    page.wait_for_selector(CHECKED)
    here, aside, turned = page.evaluate(ASIDE)
    assert 0 < here < 0.05
    assert [aside, turned] == pytest.approx([here, here], rel=0.01)
