"""How fast pages of runs and live dances are in Debian's chromium that draws on the processor.

python -m benchmarks.report.page_speed PAGE...   (results/page_speed.json)

Interactive: from the navigation until the page answers keys and draws its first picture. Pictures a
second: while it plays at its own speed, 1,600 pixels wide. Beside the clock, which a busy machine
falsifies, stands the processor time of the browser's processes: what one idle core would take.
"""

import argparse
import json
import os
import shutil
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from playwright.sync_api import Page

RESULTS = Path(__file__).parents[1] / "results" / "page_speed.json"
ARGUMENTS = ["--no-sandbox", "--enable-unsafe-swiftshader",
             "--autoplay-policy=no-user-gesture-required"]  # fmt: skip
SECONDS, WIDTH, HEIGHT = 8.0, 1600, 1000
FORCED = 40
"""Pictures that are drawn one after the other for the processor time of one."""
TICKS = os.sysconf("SC_CLK_TCK")
DRAWN = "() => robojackson.view.renderer.info.render.frame / robojackson.view.panes.length"
FORCE = """async (count) => { const { view } = robojackson;
  for (let i = 0; i < count; i++) { await new Promise((next) => requestAnimationFrame(next)); view.draw(); }
}"""  # noqa: E501
PAUSE = (
    "() => { robojackson.video ? robojackson.video.pause() : (robojackson.state.playing = false) }"
)
FIRST = """() => new Promise((done) => { const wait = () =>
  robojackson.view.renderer.info.render.frame ? done(performance.now()) : setTimeout(wait, 5); wait(); })"""  # noqa: E501


@dataclass(frozen=True)
class PageSpeed:
    """Figures of one page.

    Attributes:
        megabytes: Size of the file.
        interactive_s, interactive_cpu_s: Until it can be used, by the clock and by processor.
        pictures_a_second: While it plays, by the clock.
        picture_cpu_ms: Processor time of drawing all panes once.
        load: Runnable processes during the measurement, and cores: reliability of the clock.
    """

    file: str
    megabytes: float
    interactive_s: float
    interactive_cpu_s: float
    pictures_a_second: float
    picture_cpu_ms: float
    load: float
    cores: int


def measure(file: Path) -> PageSpeed:
    """Open a page in a browser of its own."""
    from playwright.sync_api import sync_playwright

    path = shutil.which("chromium")
    assert path, "apt-get install chromium"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.set_default_timeout(180_000)
        before = processor_s(os.getpid())
        page.goto(file.as_uri())
        page.wait_for_selector("[data-ready=yes]")
        ready_ms = page.evaluate(FIRST)
        opened_s = processor_s(os.getpid()) - before
        pictures = _played(page)
        page.evaluate(PAUSE)
        page.wait_for_timeout(500)
        before = processor_s(os.getpid())
        page.evaluate(FORCE, FORCED)
        drawn_s = processor_s(os.getpid()) - before
        browser.close()
    return PageSpeed(
        file.name, round(file.stat().st_size / 1e6, 2), round(ready_ms / 1000, 2),
        round(opened_s, 2), round(pictures, 1), round(1000 * drawn_s / FORCED, 1),
        os.getloadavg()[0], os.cpu_count() or 1,
    )  # fmt: skip


def _played(page: "Page") -> float:
    """Return the pictures a second while a page plays."""
    page.wait_for_timeout(1000)
    first, began = page.evaluate(DRAWN), time.monotonic()
    page.wait_for_timeout(1000 * SECONDS)
    return float(page.evaluate(DRAWN) - first) / (time.monotonic() - began)


def processor_s(root: int) -> float:
    """Return the processor time of a process' descendants, seconds."""
    children: dict[int, list[tuple[int, int]]] = {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                fields = Path(f"/proc/{entry}/stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            ticks = int(fields[11]) + int(fields[12])
            children.setdefault(int(fields[1]), []).append((int(entry), ticks))
    total, waiting = 0, [root]
    while waiting:
        for process, ticks in children.get(waiting.pop(), []):
            total += ticks
            waiting.append(process)
    return total / TICKS


def main() -> None:
    """Measure pages, print and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("pages", nargs="+", type=Path)
    found = [asdict(measure(page.resolve())) for page in parser.parse_args().pages]
    print(text := json.dumps(found, indent=1))
    RESULTS.write_text(text + "\n")


if __name__ == "__main__":
    main()
