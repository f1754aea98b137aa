"""The page of a performance in Debian's chromium: its film is no wider than the screen."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from robojackson.report.pages.performance_page import performance_page
from robojackson.report.video.encoder import write_video
from robojackson.rl.evaluation.performance_record import Summary
from tests.browser.conftest import Opened

pytestmark = [pytest.mark.browser, pytest.mark.timeout(900)]
WIDE = np.zeros((480, 1282, 3), np.uint8)

LOADED = "() => new Promise(done => { const wait = () => document.querySelector('video').readyState > 0 ? done() : setTimeout(wait, 50); wait(); })"  # noqa: E501


@pytest.fixture(scope="module")
def performance_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("performance")
    film = write_video([WIDE] * 10, 30, folder / "performance.mp4")
    summary: Summary = {
        "tracker": "regulator", "robot": "g1", "runs": 0, "pushes": 0.0, "finished": 0,
        "uninterrupted": 0, "survived_s": 0.0, "danced_share": 0.0, "mpjpe_l_m": 0.0,
    }  # fmt: skip
    performance_page(folder / "index.html", "hip_shake", summary, [], [], film.name)
    return folder / "index.html"


def test_the_film_fits_a_phone(opened: Callable[..., Opened], performance_file: Path) -> None:
    page = opened(performance_file, 375).page
    page.evaluate(LOADED)
    width, height = page.evaluate(
        "() => { const box = document.querySelector('video').getBoundingClientRect(); "
        "return [box.width, box.height]; }"
    )
    assert page.evaluate("document.documentElement.scrollWidth") <= 375
    assert width / height == pytest.approx(WIDE.shape[1] / WIDE.shape[0], rel=0.02)
