"""The commands that look for dances: find, refresh and catalogue.

Like `robojackson.cli.app`, each imports what it needs inside itself.
"""

import shlex
from typing import Annotated

import typer

from robojackson.cli.console import CommandResult, command, log_to_stderr
from robojackson.cli.options import Json, Robot, SetFind, overrides_from


@command
def find(
    query: Annotated[str, typer.Argument(help="A dance; or the folder, or list, of the source.")],
    top: Annotated[int | None, typer.Option(min=1, help="How many videos to assess.")] = None,
    source: Annotated[
        str | None,
        typer.Option(
            help="youtube, folder, urls, site, server, or one that you add (docs/recipes.md); "
            "without it that of the dance in dances.yaml, else youtube."
        ),
    ] = None,
    address: Annotated[
        str, typer.Option(help="Of the folder, list, site ({query} stands for it) or server.")
    ] = "",
    config: Annotated[str, typer.Option(help="Name or path of a configuration.")] = "finding",
    set_: SetFind = None,
    as_json: Json = False,
) -> CommandResult:
    """Search, assess and rank the videos of a dance; show why others are rejected."""
    from configs.find_config import FindConfig
    from flows.cli.verdicts import find_verdict
    from flows.runtime.environment import prepare
    from flows.runtime.temporary_server import temporary_server
    from flows.search import ranking_table
    from flows.search.requests import find_dance, require_online
    from robojackson.cli.cards import closing
    from robojackson.pipeline.yaml_loader import load
    from storage.store import Store

    overrides = overrides_from(set_)
    settings = load(FindConfig, config, overrides)
    dance = find_dance(query, source, address, top, settings)
    require_online(dance, settings)
    prepare(Store.from_environment())
    with temporary_server():
        from flows.find import run

        found = run(dance, config, overrides)
    found |= find_verdict(found)
    table = ranking_table.lines(found["candidates"])
    return CommandResult(found, text=[*table, found["summary"], *closing(found)])


@command
def refresh(
    dances: Annotated[
        list[str] | None, typer.Argument(help="Names in configs/dances.yaml; else all that are due")
    ] = None,
    robot: Robot = None,
    config: Annotated[str, typer.Option(help="Configuration of the search.")] = "finding",
    set_: SetFind = None,
    as_json: Json = False,
) -> CommandResult:
    """Run the nightly search now: for every dance the best new video, up to the robot's motion."""
    from flows.cli.verdicts import refresh_lines, refresh_verdict
    from flows.runtime.environment import prepare
    from flows.runtime.temporary_server import temporary_server
    from flows.search.requests import check_refresh
    from robojackson.cli.cards import closing
    from storage.store import Store

    overrides = overrides_from(set_)
    check_refresh(dances or None, config, overrides, robot)
    prepare(Store.from_environment())
    with temporary_server():
        from flows.refresh import run

        done = run(dances or None, config, overrides, robot)
    done |= refresh_verdict(done, robot)
    code = 1 if done["failed"] and not done["dances"] else 0
    return CommandResult(done, code, text=[*refresh_lines(done), *closing(done)])


@command
def catalogue(
    dance: Annotated[
        str | None, typer.Option(help="Only this dance, by its name or query.")
    ] = None,
    sql: Annotated[
        str | None, typer.Option(help="A question to DuckDB about the table `candidates`.")
    ] = None,
    as_json: Json = False,
) -> CommandResult:
    """Show every video assessed so far, and why it was danced or not."""
    from configs.dance_book import DanceBook
    from flows.cli.verdicts import catalogue_verdict
    from flows.search import ranking_table
    from robojackson.cli import console
    from robojackson.cli.cards import closing
    from robojackson.errors import BadConfiguration
    from robojackson.pipeline.yaml_loader import load
    from storage import candidate_catalogue
    from storage.store import Store

    log_to_stderr()
    store = Store.from_environment()
    if sql is not None and dance is not None:
        raise BadConfiguration("--dance and --sql: give one; SQL names a dance by itself")
    if sql is not None:
        found = candidate_catalogue.query(store, sql)
        named = {str(number): row for number, row in enumerate(found, 1)}
        text = console.table(named, list(found[0])) if found else ["no rows"]
        return CommandResult({"rows": found}, text=text)
    rows = candidate_catalogue.records(store, dance)
    if not rows and dance:  # `find` records what the book names under its name
        rows = candidate_catalogue.records(store, load(DanceBook, "dances").find(dance).name)
    if not rows:
        return CommandResult({"candidates": rows}, text=[empty_catalogue_text(dance)])
    verdict = catalogue_verdict(rows)
    text = [*ranking_table.lines(rows), *closing(verdict)]
    return CommandResult({"candidates": rows, **verdict}, text=text)


def empty_catalogue_text(dance: str | None) -> str:
    """Return how to fill a catalogue that has no rows, or none of a dance."""
    from robojackson.clips.web.untrusted_text import clean_text

    if dance is None:
        return (
            "The catalogue is empty: `robojackson find DANCE`, `robojackson dance DANCE` and "
            "`robojackson refresh` fill it; `robojackson find FOLDER --source folder` needs no "
            "network."
        )
    return (
        f"No video of {clean_text(dance)} was ever assessed: "
        f"`robojackson find {shlex.quote(dance)}` looks for some; "
        "`robojackson catalogue` lists all dances."
    )
