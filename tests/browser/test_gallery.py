"""The gallery in Debian's chromium, from disk: filters, order, odd names, narrow screens."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from robojackson.report.pages.gallery import GalleryRun, render_gallery
from tests.browser.conftest import Opened
from tests.browser.test_run_page import serious

pytestmark = [pytest.mark.browser, pytest.mark.timeout(900)]
ODD = "<script>alert(1)</script> \u202eecnad_a_very_long_name_without_any_blank_in_it"
SHOWN = (
    "() => [...document.querySelectorAll('#gallery > li:not([hidden]) h2')].map(h => h.textContent)"
)
CHOOSE = """([id, value]) => { const node = document.querySelector(id); node.value = value;
  node.dispatchEvent(new Event('change')); }"""


@pytest.fixture(scope="module")
def gallery_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    now = datetime(2026, 11, 23, tzinfo=UTC)
    runs = [
        GalleryRun(name, robot, "scratch", seed, now - timedelta(hours=seed), {"skill": skill},
                   page=f"dances/{seed}/index.html")
        for seed, (name, robot, skill) in enumerate(
            [("hip_shake", "humanoid", 0.4), ("walk", "g1", 0.9), (ODD, "humanoid", 0.6)]
        )
    ]  # fmt: skip
    file = tmp_path_factory.mktemp("gallery") / "gallery.html"
    file.write_text(render_gallery(runs), encoding="utf-8")
    return file


@pytest.mark.parametrize(("width", "scheme"), [(375, "dark"), (1600, "light")])
def test_gallery_requests_nothing_and_fits(
    opened: Callable[..., Opened], gallery_file: Path, width: int, scheme: str, axe: str
) -> None:
    found = opened(gallery_file, width, scheme)
    assert found.requests == [gallery_file.as_uri()]
    assert found.complaints == []
    assert found.page.evaluate("document.documentElement.scrollWidth") <= width
    assert serious(found.page, axe) == []


def test_gallery_filters_and_sorts(opened: Callable[..., Opened], gallery_file: Path) -> None:
    page, odd = opened(gallery_file).page, ODD.replace("\u202e", "\\u202e")
    assert page.evaluate(SHOWN) == ["hip_shake", "walk", odd]
    page.evaluate(CHOOSE, ["#sort", "skill"])
    assert page.evaluate(SHOWN) == ["walk", odd, "hip_shake"]
    page.evaluate(CHOOSE, ["[data-filter=robot]", "humanoid"])
    assert page.evaluate(SHOWN) == [odd, "hip_shake"]
    assert page.inner_text("#shown") == "2 of 3 dances"


def test_what_is_shown_is_what_is_chosen_after_back(
    opened: Callable[..., Opened], gallery_file: Path
) -> None:
    page = opened(gallery_file).page
    page.select_option("[data-filter=robot]", "humanoid")
    page.select_option("#sort", "skill")
    before = page.evaluate(SHOWN)
    page.goto("about:blank")
    page.go_back()
    page.wait_for_timeout(500)
    assert page.input_value("[data-filter=robot]") == "humanoid"
    assert page.evaluate(SHOWN) == before
    assert page.inner_text("#shown") == "2 of 3 dances"
