"""docs/settings.md lists every key of `--set`, with what it says in the code today."""

from dataclasses import dataclass

import pytest
from pydantic import Field

from robojackson.cli.options import overrides_from
from robojackson.config import config_dataclass
from robojackson.pipeline.yaml_loader import load
from tools.assets import settings_page
from tools.assets.settings_page import CHAPTERS, PAGE, Chapter, Setting


def test_the_page_is_up_to_date() -> None:
    """Else: make docs."""
    assert PAGE.read_text() == settings_page.page()


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda chapter: chapter.usual)
def test_set_accepts_every_key_with_its_default(chapter: Chapter) -> None:
    for each in settings_page.settings(chapter):
        given = overrides_from([f"{each.key}={each.default}"])
        assert load(chapter.kind, chapter.usual, given) == load(chapter.kind, chapter.usual)


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda chapter: chapter.usual)
def test_every_key_says_what_it_is_and_what_is_allowed(chapter: Chapter) -> None:
    for each in settings_page.settings(chapter):
        assert each.meaning.endswith((".", ")"))
        assert not each.meaning.startswith(("Of ", "The same")), each.key
        assert each.allowed
        assert each.default


@config_dataclass
class Documented:
    """Attributes:
    wait_s: Longest wait, seconds; 0 is none.
    low, high: Ends of the range, metres a second,
        of a foot.
    kind: Which of them.
    """

    wait_s: float = Field(default=1.0, ge=0, lt=60)
    low: float = 0.0
    high: float | None = Field(default=None, gt=0)
    kind: str = "one"


def listed(kind: type, value: object) -> list[Setting]:
    return list(settings_page._of(kind, value, "part."))


def test_unit_range_default_and_meaning_are_those_of_the_code() -> None:
    wait, low, high, kind = listed(Documented, Documented())
    assert wait == Setting(
        "part.wait_s", "s", "1.0", "≥ 0, < 60", "Longest wait, seconds; 0 is none."
    )
    assert low.meaning == high.meaning == "Ends of the range, metres a second, of a foot."
    assert (high.unit, high.default, high.allowed) == ("m/s", "null", "> 0 or `null`")
    assert (kind.unit, kind.default, kind.allowed) == ("", '"one"', "text")


@dataclass
class Silent:
    """Attributes:
    shown: Steps.
    """

    shown: int = 1
    silent: int = 2


@dataclass
class Bare:
    """Attributes:
    speed: How fast it goes.
    """

    speed: float = 1.0


@pytest.mark.parametrize(("kind", "lack"), [(Silent, "silent.*meaning"), (Bare, "speed.*unit")])
def test_a_key_without_meaning_or_unit_is_refused(kind: type, lack: str) -> None:
    with pytest.raises(ValueError, match=lack):
        listed(kind, kind())
