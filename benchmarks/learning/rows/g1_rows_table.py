"""All rows of the G1 as one Markdown table, each figure with whether its bar holds.

It stands in `docs/benchmarks_learning.md` between two comments and is replaced there by
`python -m benchmarks.learning.learning_suite table`.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.learning.policies import MOVES, ROOT
from benchmarks.learning.rows.row_bars import FEET, HANDS
from benchmarks.learning.rows.row_references import OLDER

DOCUMENT = ROOT / "docs" / "benchmarks_learning.md"
BEGIN, END = "<!-- G1 rows: begin -->", "<!-- G1 rows: end -->"
MISSED = " ✗"
COLUMNS = (
    *("move", "horizon", "seeds", "strict %, mean", "worst", "success %", "whole phases %"),
    *("skill", "mpjpe_l mm", "to a fall", "mpjpe_g mm", "to a fall", "accelerations"),
    *("gain of feet, hands", "R²", "excess m/s"),
)
Row = Mapping[str, Any]


def g1_rows_table(rows: Iterable[Row]) -> str:
    """Return the table of the G1's rows of `learning.json`."""
    return markdown_table(COLUMNS, (_cells(r) for r in rows if MOVES[r["move"]].robot == "g1"))


def markdown_table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return cells as a Markdown table."""
    lines = [_line(columns), "|---" * len(columns) + "|", *map(_line, rows)]
    return "\n".join(lines) + "\n"


def written_between(text: str, begin: str, end: str, table: str) -> str:
    """Return a document's text with what stands between two comments replaced by a table."""
    before, rest = text.split(begin)
    return f"{before}{begin}\n\n{table}\n{end}{rest.split(end)[1]}"


def update_document(rows: Iterable[Row], path: Path = DOCUMENT) -> None:
    """Replace the table of the G1's rows in a document."""
    replace_table(BEGIN, END, g1_rows_table(rows), path)


def replace_table(begin: str, end: str, table: str, path: Path = DOCUMENT) -> None:
    """Replace what stands between two comments of a document by a table."""
    text = path.read_text(encoding="utf-8")
    path.write_text(written_between(text, begin, end, table), encoding="utf-8")


def _cells(row: Row) -> list[str]:
    stale = " (older reference)" if row["reference"] == OLDER else ""
    seconds = row["horizon_s"]
    return [
        row["move"] + stale,
        f"{seconds:g} s" if seconds else "its end",
        str(row["seeds"]),
        _percent(row["strict_success"]) + _mark(row, "strict success"),
        _percent(row["worst_seed"]) + _mark(row, "worst seed"),
        _percent(row["success"]),
        _percent(row["whole_phases"]),
        f"{row['skill']:.2f}" + _mark(row, "skill"),
        _mm(row["mpjpe_l_m"]) + _mark(row, "mpjpe_l"),
        *(_mm(row[name]) for name in ("mpjpe_l_alive_m", "mpjpe_g_m", "mpjpe_g_alive_m")),
        _ratio(row["acceleration_ratio"]) + _mark(row, "acceleration"),
        _limbs(row, "limb_gain", "gain"),
        _limbs(row, "limb_r2", "R2"),
        _limbs(row, "excess_speed", "excess"),
    ]


def _limbs(row: Row, figures: str, bar: str) -> str:
    """Return a figure of both feet and both hands."""
    found = ((limb, row[figures][limb]) for limb in (*FEET, *HANDS))
    return ", ".join(
        "-" if figure is None else f"{figure:.2f}{_mark(row, f'{bar} {limb}')}"
        for limb, figure in found
    )


def _mark(row: Row, bar: str) -> str:
    """Return a mark where the bar whose name begins so is missed."""
    held = next((held for name, held in row["bars"].items() if name.startswith(bar)), True)
    return "" if held else MISSED


def _percent(share: float) -> str:
    return f"{100 * share:.1f}"


def _ratio(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def _mm(metres: float | None) -> str:
    return "-" if metres is None else f"{1e3 * metres:.0f}"


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
