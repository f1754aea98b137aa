"""The page of a run in Debian's chromium, from disk."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.browser.conftest import CYCLE, FALLEN, FPS, LEVEL, WITHOUT_3D, Opened

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = [pytest.mark.browser, pytest.mark.timeout(900)]
Open = Callable[..., Opened]
SHOWN = """() => {
  const { video, state } = robojackson, canvas = document.createElement('canvas');
  canvas.width = canvas.height = 8;
  const pen = canvas.getContext('2d');
  pen.drawImage(video, video.videoWidth / 2 - 5, video.videoHeight / 2 - 5, 10, 10, 0, 0, 8, 8);
  return { drawn: state.drawn, picture: state.picture, grey: pen.getImageData(4, 4, 1, 1).data[0] };
}"""
DRAWN = "k => new Promise(done => { const wait = () => robojackson.state.drawn === k ? done() : setTimeout(wait, 20); wait(); })"  # noqa: E501
"""Playwright's own wait_for_function evaluates text, which the page's security policy forbids."""
ARRIVED = "k => new Promise(done => { let left = 400; const wait = () => robojackson.state.drawn === k || !left-- ? done(robojackson.state.drawn) : setTimeout(wait, 25); wait(); })"  # noqa: E501
"""The picture drawn: a requested one, or another where that does not come."""
OUTSIDE = """() => { const { view, data, state } = robojackson, pane = view.panes[2], row = data.trained.row;
  view.aim(pane); pane.camera.updateMatrixWorld();
  const place = (at) => new THREE.Vector3(...data.trained.values.slice(at, at + 3)).project(pane.camera);
  let most = 0;
  for (let at = state.picture * row + 7; at < (state.picture + 1) * row; at += 7) most = Math.max(most, ...place(at).toArray().slice(0, 2).map(Math.abs));
  return most; }"""  # noqa: E501
"""How far the bodies of the robot are from the middle of its pane; 1 is the edge."""
UNDECODABLE = """(() => { const whole = URL.createObjectURL;
  URL.createObjectURL = () => whole.call(URL, new Blob(['no film'], { type: 'video/mp4' })); })()"""
LOSE = """() => new Promise(done => { const { view } = robojackson, gl = view.renderer.getContext().getExtension('WEBGL_lose_context');
  view.canvas.addEventListener('webglcontextrestored', () => setTimeout(done, 300), { once: true });
  gl.loseContext(); setTimeout(() => gl.restoreContext(), 300); })"""  # noqa: E501
SIZES = "() => [...document.querySelectorAll('.orbit .pane')].map(pane => pane.getBoundingClientRect().toJSON())"  # noqa: E501
PLACED = "share => { const over = document.querySelector('#plot-angle .u-over'); over.scrollIntoView({ block: 'center' }); const box = over.getBoundingClientRect(); return [box.left + share * box.width, box.top + box.height / 2]; }"  # noqa: E501
SECONDS = "x => { const [curve] = robojackson.curves; return curve.posToVal(x - curve.over.getBoundingClientRect().left, 'x'); }"  # noqa: E501
"""Time at a place of a curve on the screen."""
CLOCK = "document.getElementById('clock').textContent"
GO = "k => { robojackson.video.pause(); robojackson.go(k); }"


@pytest.mark.parametrize("width", [375, 1600])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_requests_nothing_logs_no_error_and_fits(
    opened: Open, page_file: Path, width: int, scheme: str
) -> None:
    found = opened(page_file, width, scheme)
    found.page.wait_for_timeout(1500)
    assert [url for url in found.requests if not url.startswith(("blob:", "data:"))] == [
        page_file.as_uri()
    ]
    assert found.complaints == []
    assert found.page.evaluate("document.documentElement.scrollWidth") <= width


def test_markup_and_turned_text_of_a_title_are_text(opened: Open, page_file: Path) -> None:
    page = opened(page_file).page
    assert page.inner_text("h1") == "<script>alert(1)</script> \\u202emosnart"
    assert page.title().startswith("<script>alert(1)</script> \\u202emosnart")


@pytest.mark.parametrize("picture", [3, 20, 41])
def test_panes_and_picture_are_of_one_moment_after_a_seek(
    opened: Open, page_file: Path, picture: int
) -> None:
    page = opened(page_file).page
    page.evaluate(GO, picture)
    page.evaluate(DRAWN, picture)
    assert_one_moment(page.evaluate(SHOWN), picture)


def test_panes_and_picture_are_of_one_moment_after_steps(opened: Open, page_file: Path) -> None:
    page = opened(page_file).page
    page.evaluate(GO, 10)
    page.evaluate(DRAWN, 10)
    page.focus("#player")
    for key, picture in (("ArrowRight", 11), ("ArrowRight", 12), ("ArrowLeft", 11)):
        page.keyboard.press(key)
        page.evaluate(DRAWN, picture)
        assert_one_moment(page.evaluate(SHOWN), picture)


def test_panes_follow_the_picture_while_it_plays_and_when_it_pauses(
    opened: Open, page_file: Path
) -> None:
    page = opened(page_file).page
    page.evaluate("robojackson.video.play()")
    for _ in range(5):
        page.wait_for_timeout(300)
        shown = page.evaluate(SHOWN)
        assert abs(shown["drawn"] - shown["picture"]) <= 1
    page.evaluate("robojackson.video.pause()")
    page.wait_for_timeout(800)
    shown = page.evaluate(SHOWN)
    assert_one_moment(shown, shown["picture"])


def assert_one_moment(shown: dict[str, int], picture: int) -> None:
    """Require that the panes draw a picture and that the clip shows it or a neighbour."""
    assert shown["drawn"] == shown["picture"] == picture
    seen = round(shown["grey"] / LEVEL) - 1
    assert (seen - picture + 1) % CYCLE <= 2


def test_keyboard_slows_and_shows_the_ghost(opened: Open, page_file: Path) -> None:
    page = opened(page_file).page
    page.focus("#player")
    page.keyboard.press("s")
    page.keyboard.press("g")
    assert page.evaluate("robojackson.video.playbackRate") == 0.25
    assert page.get_attribute("#ghost", "aria-pressed") == "true"


def test_keys_work_before_anything_is_in_focus(opened: Open, page_file: Path) -> None:
    page = opened(page_file, 800).page
    page.evaluate("robojackson.video.pause()")
    page.keyboard.press("s")
    page.keyboard.press(" ")
    assert page.evaluate("robojackson.video.playbackRate") == 0.25
    assert page.evaluate("[robojackson.video.paused, scrollY]") == [False, 0]


def test_steps_in_quick_succession_add_up(opened: Open, page_file: Path) -> None:
    page = opened(page_file, 800).page
    page.evaluate(GO, 10)
    page.evaluate(DRAWN, 10)
    page.evaluate("() => { for (let k = 0; k < 5; k++) robojackson.step(1); }")
    assert page.evaluate(ARRIVED, 15) == 15
    page.evaluate("robojackson.step(-1)")
    assert page.evaluate(ARRIVED, 14) == 14


def test_the_thumb_of_a_focused_seek_bar_follows_the_dance(opened: Open, page_file: Path) -> None:
    page = opened(page_file, 800).page
    page.evaluate(GO, 3)
    page.evaluate(DRAWN, 3)
    page.focus("#seek")
    page.keyboard.press(" ")
    page.wait_for_timeout(1500)
    thumb, picture = page.evaluate(
        "[Number(document.getElementById('seek').value), robojackson.state.picture]"
    )
    assert picture != 3
    assert thumb == picture


def test_a_click_on_a_curve_while_it_plays_goes_to_the_place_of_the_click(
    opened: Open, page_file: Path
) -> None:
    page = opened(page_file, 800).page
    page.evaluate("robojackson.video.play()")
    x, y = page.evaluate(PLACED, 0.25)
    seconds = page.evaluate(SECONDS, x)
    page.mouse.move(x, y)
    page.mouse.down()
    page.wait_for_timeout(400)
    page.mouse.up()
    picture = round(seconds * FPS)
    assert page.evaluate(ARRIVED, picture) == picture


def drawn_bytes(page: "Page") -> list[int]:
    """Return the size of each pane's picture as PNG: an empty one compresses to little."""
    boxes = page.evaluate(SIZES)
    return [
        len(page.screenshot(clip={key: box[key] for key in ("x", "y", "width", "height")}))
        for box in boxes
    ]


def test_panes_are_drawn_again_after_a_lost_context(opened: Open, page_file: Path) -> None:
    page = opened(page_file, 800).page
    page.evaluate(GO, 3)
    page.evaluate(DRAWN, 3)
    before = drawn_bytes(page)
    page.evaluate(LOSE)
    page.wait_for_timeout(1000)
    assert drawn_bytes(page) == pytest.approx(before, rel=0.1)


def test_without_3d_film_curves_and_joints_remain(opened: Open, page_file: Path) -> None:
    page = opened(page_file, 800, before=WITHOUT_3D).page
    page.wait_for_selector("[data-ready=yes]")
    assert "draws no 3D" in page.inner_text("#flat")
    page.evaluate(GO, 20)
    page.wait_for_timeout(1500)
    assert page.evaluate(CLOCK) == f"{20 / FPS:.2f} s"
    assert page.locator("#joint option").count() > 1
    assert page.locator("#plot-angle canvas").count() == 1
    assert opened(page_file, 800).page.is_hidden("#flat")


def test_a_film_that_cannot_be_decoded_does_not_stop_the_player(
    opened: Open, page_file: Path
) -> None:
    page = opened(page_file, 800, before=UNDECODABLE).page
    page.wait_for_selector("#undecoded:not([hidden])", state="attached")
    assert page.inner_text("#play") == "Pause"
    begun = page.evaluate(CLOCK)
    page.wait_for_timeout(700)
    assert page.evaluate(CLOCK) != begun
    page.click("#play")
    page.evaluate("robojackson.go(40)")
    assert page.evaluate(ARRIVED, 40) == 40
    page.evaluate("() => { for (let k = 0; k < 3; k++) robojackson.step(1); }")
    assert page.evaluate(ARRIVED, 43) == 43
    assert page.inner_text("#play") == "Play"


def test_sound_begins_with_its_button(opened: Open, page_file: Path) -> None:
    page = opened(page_file).page
    button = page.locator("#sound")
    assert (button.inner_text(), page.evaluate("robojackson.video.muted")) == ("Sound on", True)
    button.click()
    assert (button.inner_text(), page.evaluate("robojackson.video.muted")) == ("Sound off", False)


def test_a_dance_that_ended_has_no_curve_after_its_end(opened: Open, fallen_page: Path) -> None:
    page = opened(fallen_page).page
    found = page.evaluate("robojackson.curves.map((curve) => curve.data.slice(1))")
    angles, _, error = found
    assert [values.index(None) for values in (angles[1], error[0])] == [FALLEN, FALLEN]
    assert None not in angles[0]


def test_the_robot_that_fell_is_in_its_pane(opened: Open, fallen_page: Path) -> None:
    """It is as large as its reference before, and shown whole when it lies."""
    page = opened(fallen_page).page
    page.evaluate(GO, 2)
    page.evaluate(DRAWN, 2)
    sizes = page.evaluate("robojackson.view.panes.map((pane) => pane.width)")
    assert sizes[1] == pytest.approx(sizes[2])
    page.evaluate(GO, FALLEN + 5)
    page.evaluate(DRAWN, FALLEN + 5)
    assert page.evaluate("robojackson.view.panes[2].width") > 1.2 * sizes[2]
    assert page.evaluate(OUTSIDE) < 1


def test_axe_finds_nothing_serious(opened: Open, page_file: Path, axe: str) -> None:
    page = opened(page_file).page
    page.evaluate("robojackson.video.pause()")
    assert serious(page, axe) == []


def serious(page: object, axe: str) -> list[str]:
    """Return the rules of axe-core that are broken seriously."""
    found = page.evaluate(f"async () => {{ {axe}; return (await axe.run()).violations }}")  # type: ignore[attr-defined]
    return [
        f"{one['id']}: {one['nodes'][0]['html'][:80]}"
        for one in found
        if one["impact"] in ("serious", "critical")
    ]
