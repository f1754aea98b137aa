"""The page of a performance: its film, its parts and its runs."""

from collections.abc import Sequence
from pathlib import Path

from robojackson.files.file_tree import FileTree
from robojackson.report.pages import inline
from robojackson.report.pages.evaluation_text import Verdict
from robojackson.report.quantities import Quantity, format_value
from robojackson.rl.evaluation.performance_record import PartRow, RunRow, Summary

PART_COLUMNS = ("part", "length", "runs that began", "danced whole", "infeasible", "error")
RUN_COLUMNS = ("seed", "up for", "given up", "danced", "carried off", "away", "error")


def performance_page(
    out: Path,
    title: str,
    summary: Summary,
    parts: Sequence[PartRow],
    runs: Sequence[RunRow],
    film: str | None,
) -> None:
    """Write the page as one file.

    Args:
        film: Name of the film beside it; None without one.

    Raises:
        StoreError: it cannot be written.
    """
    styles = [inline.own("page.css")]
    text = inline.render(
        "performance.html",
        styles,
        [],
        security=inline.policy([], styles).replace("media-src blob:", "media-src 'self'"),
        title=title,
        summary=summary,
        film=film,
        part_columns=_head(PART_COLUMNS),
        parts=[_part(i + 1, row) for i, row in enumerate(parts)],
        run_columns=_head(RUN_COLUMNS),
        runs=[_run(row) for row in runs],
    )
    FileTree(out.parent).write(out.name, text.encode())


def _head(names: Sequence[str]) -> list[Quantity]:
    return [Quantity("", ""), *(Quantity(name, "") for name in names[1:])]


def _part(number: int, row: PartRow) -> Verdict:
    shares = (f"{row['began']}", f"{row['whole']}", f"{100 * row['infeasible_share']:.0f} %")
    values = (f"{row['seconds']:.1f} s", *shares, _millimetres(row["mpjpe_l_m"]))
    return Verdict(f"{number} {row['part']}", "", values, row["is_dance"])


def _run(row: RunRow) -> Verdict:
    fell = f"fell in {row['fell_in']}" if row["fell_in"] else "stood at the end"
    values = (
        format_value("survived_s", row["survived_s"]),
        row["given_up"] or "nothing",
        f"{100 * row['danced_share']:.0f} %",
        f"{row['carried']} times",
        f"{row['away_m']:.1f} m",
        _millimetres(row["mpjpe_l_m"]),
    )
    return Verdict(f"{row['seed']}", fell, values, row["finished"])


def _millimetres(value: float | None) -> str:
    return "-" if value is None else f"{1000 * value:.0f} mm"
