"""What the documents of the layout name is there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
RECIPES = (ROOT / "docs" / "recipes.md").read_text()
PLACEHOLDER = "NAME"
MOST_FILES = 3


def recipes() -> dict[str, list[str]]:
    """The numbered steps of every recipe, by its title."""
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


def test_the_new_names_of_modules_are_those_of_files() -> None:
    table = (ROOT / "docs" / "renames.md").read_text().split("## Functions")[0]
    new = re.findall(r"(?m)^\| `[\w.]+` \| `([\w.]+)` \|$", table)
    assert len(new) > 300
    assert [m for m in new if not (ROOT / (m.replace(".", "/") + ".py")).is_file()] == []
