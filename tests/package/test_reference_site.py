"""The site is built without a warning, and every link in it leads somewhere."""

import shutil
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import robojackson as rj
from tests.package.conftest import ROOT

pytestmark = pytest.mark.slow


class Page(HTMLParser):
    """Collect the links and the anchors of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect `href`, `src`, `id` and `name`."""
        for name, value in attrs:
            if value and name in ("href", "src") and tag != "link":
                self.links.append(value)
            elif value and (name == "id" or (tag == "a" and name == "name")):
                self.anchors.add(value)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    shutil.copytree(ROOT / "docs", folder / "docs")
    shutil.copy(ROOT / "mkdocs.yml", folder)
    (folder / "robojackson").symlink_to(ROOT / "robojackson")
    words = (sys.executable, "-m", "zensical", "build", "--strict")
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "build" / "site"


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Page]:
    return {path: Page(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")}


def dead_links(site: Path, pages: dict[Path, Page]) -> Iterator[str]:
    """Yield every link of the site that leads to no file, or to no anchor of its page."""
    for path, page in pages.items():
        if path.name == "404.html":
            continue
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            target = target / "index.html" if target.is_dir() else target
            anchors = pages[target].anchors if target in pages else set()
            lost = parts.fragment and target.suffix == ".html" and parts.fragment not in anchors
            if not target.is_file() or lost:
                yield f"{path.relative_to(site)}: {link}"


def test_every_link_of_the_site_leads_somewhere(site: Path, pages: dict[Path, Page]) -> None:
    assert len(pages) > 25
    assert list(dead_links(site, pages)) == []


def test_dead_links_and_anchors_are_found(tmp_path: Path) -> None:
    text = '<a id="b" href="#b"></a><a href="#c"></a><img src="d.png"><a href="https://e.org"></a>'
    page = tmp_path / "index.html"
    page.write_text(text)
    assert list(dead_links(tmp_path, {page: Page(text)})) == ["index.html: #c", "index.html: d.png"]


def test_every_public_name_stands_in_the_reference(pages: dict[Path, Page]) -> None:
    anchors = {anchor for page in pages.values() for anchor in page.anchors}
    public = set(rj.__all__) - {"__version__", "RoboJacksonError"}
    assert {name for name in public if not any(a.endswith(f".{name}") for a in anchors)} == set()


def test_every_page_of_docs_is_in_the_navigation() -> None:
    text = (ROOT / "mkdocs.yml").read_text()
    named = {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")}
    assert {name for name in named if f": {name}\n" not in text} == set()
