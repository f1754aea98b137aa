"""The passport of a policy as lines of the terminal."""

from collections.abc import Mapping
from typing import Any

from robojackson.cli import console

COLUMNS = ("strict_success", "success", "skill", "survived_s", "kept", "robust")


def passport_lines(evaluation: Mapping[str, Any]) -> list[str]:
    """Return the table of a passport and its verdict; nothing where none was made."""
    rows = evaluation.get("passport", [])
    if not rows:
        return []
    table = console.table({row["case"]: row for row in rows}, COLUMNS)
    share = evaluation.get("passport_least_kept")
    if share is None:  # of an evaluation before 27 November 2026
        return table
    least = f"{100 * share:.0f} % of the nominal strict success"
    failed = [row["case"] for row in rows if not row["robust"]]
    verdict = (
        f"Not robust: {len(rows) - len(failed)} of {len(rows)} cases keep {least}, "
        f"not: {', '.join(failed)}."
        if failed
        else f"Robust: each of {len(rows)} cases keeps {least}."
    )
    return [*table, verdict]
