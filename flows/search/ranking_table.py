"""The ranked table of candidates: for a terminal, for JSON, and for Prefect's pages. No Prefect."""

import io
import shutil
from collections.abc import Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from robojackson.clips.web.untrusted_text import clean_text, in_markdown, isolated, web_address

Row = Mapping[str, Any]
NARROWEST, USUAL, WIDEST = 100, 140, 200
"""Columns of a terminal that the table is drawn for; of a file or a pipe."""
TITLE_SHARE = 0.22
"""Widest title, widths of the table."""
MARKS = {"chosen": "►", "accepted": " ", "rejected": "✗", "failed": "!"}
STYLES = {"chosen": "bold green", "accepted": "", "rejected": "dim", "failed": "red"}
FIGURES = {
    "score/s": ("score_per_second", "{:.2f}"),
    "score": ("stability_score", "{:.2f}"),
    "sec": ("duration_s", "{:.1f}"),
    "views": ("view_count", "{:,}"),
    "body": ("full_body_share", "{:.0%}"),
    "px": ("person_height_px", "{:.0f}"),
    "ppl": ("people", "{:d}"),
    "cuts": ("cuts", "{:d}"),
    "still": ("static_share", "{:.0%}"),
}
"""Head of a column to the figure below it and its form."""


def lines(rows: Sequence[Row], width: int | None = None) -> list[str]:
    """Return the table as lines of text, no wider than the terminal; styles only where there is
    one."""
    columns = shutil.get_terminal_size((USUAL, 0)).columns
    wide = width or min(max(columns, NARROWEST), WIDEST)
    sink = io.StringIO()
    Console(file=sink, width=wide, no_color=True, highlight=False).print(table(rows, wide))
    return [line.rstrip() for line in sink.getvalue().splitlines()]


def table(rows: Sequence[Row], width: int = USUAL) -> Table:
    """Return the table; text from the web stands in `Text`, so that its markup is not
    interpreted."""
    made = Table(box=SIMPLE_HEAD, header_style="bold", pad_edge=False, padding=(0, 1, 0, 0))
    made.add_column("")
    made.add_column("title", overflow="ellipsis", no_wrap=True, max_width=int(TITLE_SHARE * width))
    shown = [figure for figure in FIGURES.items() if any(_has(row, figure[1]) for row in rows)]
    for head, _ in shown:
        made.add_column(head, justify="right", no_wrap=True)
    made.add_column("reason", ratio=1, overflow="fold", min_width=12)
    for row in rows:
        decision = str(row["decision"])
        cells = [_form(row, *figure) for _, figure in shown]
        made.add_row(
            MARKS[decision], _format_value(_title(row)), *cells, _format_value(row.get("reason")),
            style=STYLES[decision],
        )  # fmt: skip
    return made


def plain_rows(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return the table for Prefect's pages: the same columns, numbers rounded."""
    shown = []
    for row in rows:
        figures = {head: _form(row, *figure) for head, figure in FIGURES.items()}
        ends = {"reason": clean_text(row.get("reason")), "url": web_address(row.get("url"))}
        shown.append({"decision": row["decision"], "title": _title(row), **figures, **ends})
    return shown


def markdown(name: str, rows: Sequence[Row]) -> str:
    """Return the candidates with their pictures, for Prefect's pages."""
    head = f"# {in_markdown(clean_text(name))}\n\n| | title | score | decision | reason |\n"
    body = [_markdown_row(row) for row in rows]
    return head + "|---|---|---|---|---|\n" + "\n".join(body) + "\n"


def _markdown_row(row: Row) -> str:
    picture, url = web_address(row.get("thumbnail")), web_address(row.get("url"))
    title = in_markdown(_title(row))
    cells = (
        f"![]({in_link(picture)})" if picture else "",
        f"[{title}]({in_link(url)})" if url else title,
        _form(row, *FIGURES["score"]),
        str(row["decision"]),
        in_markdown(clean_text(row.get("reason"), 200)),
    )
    return "| " + " | ".join(cells) + " |"


def in_link(address: str) -> str:
    """Return an address that does not end a link or a cell of Markdown."""
    return address.replace("(", "%28").replace(")", "%29").replace("|", "%7C")


def _title(row: Row) -> str:
    return clean_text(row.get("title")) or clean_text(row.get("video_id"))


def _format_value(value: Any) -> Text:
    return Text(isolated(clean_text(value, 200)))


def _has(row: Row, figure: tuple[str, str]) -> bool:
    return row.get(figure[0]) is not None


def _form(row: Row, name: str, form: str) -> str:
    value = row.get(name)
    return "-" if value is None else form.format(value)
