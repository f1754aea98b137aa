"""What the documents name is there."""

import re
from pathlib import Path

import pytest

from tests.fixtures import checkout

ROOT = Path(__file__).parents[2]
RECIPES = (ROOT / "docs" / "recipes.md").read_text()
PLACEHOLDER = "NAME"
MOST_FILES = 3


def recipes() -> dict[str, list[str]]:
    """Return the numbered steps of every recipe, by its title."""
    parts = re.split(r"(?m)^## ", RECIPES)[1:]
    return {part.splitlines()[0]: re.findall(r"(?m)^\d\. (.*)$", part) for part in parts}


def test_there_is_a_recipe_for_each_of_the_six_changes() -> None:
    words = ("reward term", "exporter", "robot", "contact detector", "flow", "video source")
    assert all(any(word in title for title in recipes()) for word in words)


@pytest.mark.parametrize("title", recipes())
def test_a_recipe_touches_at_most_three_files(title: str) -> None:
    steps = recipes()[title]
    assert 1 <= len(steps) <= MOST_FILES
    assert all(re.match(r"`[\w./]+`", step) for step in steps)


def test_the_files_of_the_recipes_are_there() -> None:
    named = set(re.findall(r"`([\w/]+\.(?:py|yaml|md))`", RECIPES))
    assert [p for p in named if PLACEHOLDER not in p and not (ROOT / p).is_file()] == []


@pytest.mark.parametrize("title", recipes())
def test_every_name_of_a_recipe_is_in_a_file_that_it_names(title: str) -> None:
    """A reader who follows a recipe never has to search for the module of a name."""
    text = next(p for p in re.split(r"(?m)^## ", RECIPES) if p.startswith(title))
    text = text.split("Tried:")[0]
    files = set(re.findall(r"`([\w/]+\.(?:py|yaml))`", text))
    read = "".join((ROOT / p).read_text() for p in files if PLACEHOLDER not in p)
    names = set(re.findall(r"`([A-Za-z_]\w*)[`(]", text)) - {PLACEHOLDER}
    assert [n for n in sorted(names) if PLACEHOLDER not in n and n not in read] == []


def test_the_new_names_of_modules_are_those_of_files() -> None:
    table = (ROOT / "docs" / "renames.md").read_text().split("## Functions")[0]
    new = re.findall(r"(?m)^\| `[\w.]+` \| `([\w.]+)` \|$", table)
    assert len(new) > 300
    assert [m for m in new if not (ROOT / (m.replace(".", "/") + ".py")).is_file()] == []


def documents() -> list[Path]:
    """Return the Markdown files of the repository."""
    return [ROOT / name for name in checkout.files() if name.endswith(".md")]


def links(text: str) -> list[str]:
    """Return the targets of links and pictures that are no address and no place in the same
    page."""
    plain = re.sub(r"(?ms)^```.*?^```|`[^`\n]*`", "", text)
    found = re.findall(r"\]\(<?([^)\s>]+)", plain) + re.findall(r"(?m)^\[[^]]+\]:\s*(\S+)", plain)
    found += re.findall(r"<(?:img|a|source|video)\b[^>]*?(?:src|href)=\"([^\"]+)\"", plain)
    return [link for link in found if not re.match(r"[a-z][a-z+.-]*:|#|//", link)]


def test_every_relative_link_leads_to_a_file() -> None:
    assert len(documents()) > 20
    dead = [
        f"{path.relative_to(ROOT)}: {link}"
        for path in documents()
        for link in links(path.read_text(encoding="utf-8"))
        if not (path.parent / link.partition("#")[0]).exists()
    ]
    assert dead == []


def test_links_are_found_in_all_their_forms() -> None:
    text = '[a](b.md#c) ![d](e.png "f") [g]\n\n[g]: h.md\n<img src="i.svg"> `[x](y)` [z](https://z.org)'
    assert links(text) == ["b.md#c", "e.png", "h.md", "i.svg"]


def test_the_new_names_of_functions_are_those_of_the_code() -> None:
    table = (
        (ROOT / "docs" / "renames.md").read_text().split("## Functions")[1].split("## Fields")[0]
    )
    rows = re.findall(r"(?m)^\| `([\w.]+)` \| `[\w.]+` \| `([\w.]+)` \|$", table)
    assert len(rows) > 150
    files = {module: ROOT / (module.replace(".", "/") + ".py") for module, _ in rows}
    text = {module: file.read_text(encoding="utf-8") for module, file in files.items()}
    lost = [f"{m}: {n}" for m, n in rows if not re.search(rf"\b{n.split('.')[-1]}\b", text[m])]
    assert lost == []


def test_a_copy_without_git_has_the_same_files(tmp_path: Path) -> None:
    """README's second command failed in a ZIP or tarball of the repository."""
    for name in ("README.md", "docs/a.md", ".ci/run", "store/x.md", ".venv/y.md", "a.egg-info/z"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
    assert checkout.files(tmp_path) == [".ci/run", "README.md", "docs/a.md"]
