"""The command `clean`: how big and how old the store is, and what may go."""

import shlex
import sys
from collections.abc import Iterable, Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from robojackson.cli.console import CommandResult, command
from robojackson.cli.options import Json

if TYPE_CHECKING:
    from storage.store_cleaning import Cleaning, Removal
    from storage.store_inventory import Item

DAY_S, MEGABYTE = 86_400.0, 1e6
LONGEST_LIST = 20
"""Files and folders that are named; the rest is counted."""


class Choice(StrEnum):
    """Kinds of `storage.store_inventory` that may go; of a `Literal`, typer makes no list."""

    WORK = "work"
    UNUSED = "unused"
    VIDEOS = "videos"
    CACHE = "cache"
    RUNS = "runs"


@command
def clean(
    kinds: Annotated[
        list[Choice] | None,
        typer.Option("--kind", help="What may go; work and unused by itself."),
    ] = None,
    older_than: Annotated[
        float, typer.Option("--older-than", min=0, help="Only what is this old, days.")
    ] = 30.0,
    delete: Annotated[
        bool, typer.Option("--delete", "--yes", help="Remove it; without, it is only listed.")
    ] = False,
    as_json: Json = False,
) -> CommandResult:
    """Show what is in the store, how old and how big; with --delete remove what is old.

    What a record, a run or a table refers to stays unless its kind is named; so does what a
    process works on.
    """
    from storage.store import Store
    from storage.store_cleaning import USUAL, Removal, plan, remove
    from storage.store_inventory import KINDS

    store = Store.from_environment()
    chosen = [kind for kind in KINDS if kind in (kinds or ())]
    found = plan(store, chosen or USUAL, older_than * DAY_S)
    done = remove(store, found) if delete else Removal(found.going, {})
    gone = done.gone
    data = {
        "store": store.root,
        "kinds": {kind: summary(found.items, kind) for kind in KINDS},
        "removed": delete,
        "items": [{"key": i.key, "kind": i.kind, "size_mb": _mb([i])} for i in gone],
        "size_mb": _mb(gone),
        "failed": done.failed,
        "waiting": found.users,
    }
    text = [*_table(found), "", *_closing(found, done, delete, older_than)]
    return CommandResult(data, 1 if done.failed else 0, text)


def summary(items: "Sequence[Item]", kind: str) -> dict[str, Any]:
    """Return how many, how big and how old the items of a kind are."""
    of = [item for item in items if item.kind == kind]
    ages = [item.age_s / DAY_S for item in of]
    return {
        "items": len(of),
        "size_mb": _mb(of),
        "newest_days": round(min(ages), 1) if ages else None,
        "oldest_days": round(max(ages), 1) if ages else None,
    }


def _table(found: "Cleaning") -> list[str]:
    from storage.store_inventory import KINDS

    rows = [f"{'kind':<7} {'items':>6} {'MB':>9}  {'age in days':>13}"]
    for kind, words in KINDS.items():
        of = summary(found.items, kind)
        ages = f"{of['newest_days']:g} to {of['oldest_days']:g}" if of["items"] else "-"
        rows.append(f"{kind:<7} {of['items']:>6} {of['size_mb']:>9,.1f}  {ages:>13}  {words}")
    return rows


def _closing(found: "Cleaning", done: "Removal", delete: bool, older_than: float) -> list[str]:
    gone = done.gone
    rows = _shortened(f"  {i.key}  {_mb([i]):,.1f} MB, {i.age_s / DAY_S:.0f} days" for i in gone)
    rows += _shortened(f"could not be removed: {k} ({why})" for k, why in done.failed.items())
    if found.users and len(found.going) < len(found.old):
        rows.append(
            f"{_counted(len(found.old) - len(found.going))} left while the store is in use by "
            f"{', '.join(found.users)}."
        )
    size = f"{_counted(len(gone))}, {_mb(gone):,.1f} MB"
    if not gone and not done.failed:
        what = "was removed" if delete else "would go"
        return [
            *rows,
            f"Nothing {what}: of these kinds, nothing that may go is {older_than:g} days old; "
            "--older-than DAYS and --kind KIND look further.",
        ]
    if delete:
        return [*rows, f"Removed: {size}."]
    from robojackson.cli.lifetime.interruption import program

    words = [word for word in sys.argv[1:] if word != "--json"]
    again = shlex.join([program(), *words, "--delete"])
    return [*rows, f"Would go: {size}. Nothing was removed.", f"next: {again}"]


def _shortened(listed: Iterable[str]) -> list[str]:
    rows = list(listed)
    more = len(rows) - LONGEST_LIST
    return rows if more <= 0 else [*rows[:LONGEST_LIST], f"  and {more} more"]


def _counted(number: int) -> str:
    return f"{number:,} item{'' if number == 1 else 's'}"


def _mb(items: "Sequence[Item]") -> float:
    return round(sum(item.size for item in items) / MEGABYTE, 1)
