"""The table of candidates, whatever their titles try."""

import re
from typing import Any

import pytest
from rich.cells import cell_len

from flows.search import ranking_table

HOSTILE = {
    "escape": "\x1b[2J\x1b]0;owned\x07cleared",
    "markup": "[red]red[/red] [link=http://x]y[/link] [/]",
    "lines": "one\ntwo\r\nthree\tfour",
    "arabic": "رقصة أبت 2024 كاملة",
    "override": "\u202eesrever\u2066",
    "wide": "아파트 아파트 " * 30,
    "long": "x" * 300,
    "marks": "Z\u0335\u0301\u0302\u0303" * 60,
    "table": "a | b | c `code` <script>alert(1)</script>",
    "emoji": "👨‍👩‍👧‍👦🇰🇷" * 20,
    "empty": "",
}
SHAPE = re.compile(r"^ [►✗! ]  ")


def row(title: str, **more: Any) -> dict[str, Any]:
    return {
        "video_id": "x",
        "title": title,
        "url": "https://host/watch?v=x",
        "decision": "rejected",
        "reason": title,
        "stability_score": 1.25,
        "people": 2,
        **more,
    }


@pytest.fixture(params=HOSTILE)
def title(request: pytest.FixtureRequest) -> str:
    return HOSTILE[request.param]


@pytest.mark.parametrize("width", [100, 140, 200])
def test_no_title_breaks_the_table(title: str, width: int) -> None:
    lines = ranking_table.lines([row("a"), row(title), row("b")], width)
    assert max(map(cell_len, lines)) <= width
    assert not any(ord(c) < 32 or ord(c) == 127 for line in lines for c in line)
    figures = [line for line in lines if "1.25" in line]
    assert len(figures) == 3
    assert all(SHAPE.match(line) for line in figures)


def test_figures_stand_below_one_another(title: str) -> None:
    lines = [line for line in ranking_table.lines([row("a"), row(title)], 140) if "1.25" in line]
    before = {cell_len(line[: line.index("1.25")]) for line in lines}
    assert len(before) == 1


def test_markup_in_a_title_is_text() -> None:
    text = "\n".join(ranking_table.lines([row("[red]x[/red]")], 140))
    assert "[red]x[/red]" in text


def test_no_title_breaks_the_markdown(title: str) -> None:
    lines = ranking_table.markdown("APT", [row(title)]).splitlines()
    unescaped = re.sub(r"\\.", "", lines[-1])
    assert len(lines) == 5
    assert (unescaped.count("|"), "<" in unescaped, "`" in unescaped) == (6, False, False)


def test_a_picture_from_elsewhere_than_the_web_is_not_shown() -> None:
    text = ranking_table.markdown(
        "APT", [row("a", thumbnail="javascript:alert(1)", url="file:///x")]
    )
    assert "javascript" not in text
    assert "file:" not in text


def test_the_chosen_one_is_marked() -> None:
    lines = ranking_table.lines([row("a", decision="chosen"), row("b")], 100)
    assert [line[1] for line in lines if "1.25" in line] == ["►", "✗"]


def test_a_figure_without_values_takes_no_room() -> None:
    head = ranking_table.lines([row("a")], 140)[1]
    assert "views" not in head
    assert "ppl" in head


def test_with_every_figure_the_narrowest_table_cuts_no_reason() -> None:
    figures = {"view_count": 123456789, "duration_s": 59.9, "stability_score": 5940.25}
    shares = {"full_body_share": 1.0, "static_share": 1.0, "person_height_px": 1920.0, "cuts": 12}
    lines = ranking_table.lines([row("a" * 60, reason="b" * 30, **figures, **shares)], 100)
    assert "".join(lines).count("b") - lines[1].count("b") == 30
