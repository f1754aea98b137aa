"""The commands about experiments: `ablation`, `metrics` and `deploy`."""

from typing import Annotated, Any, Literal

import typer

from robojackson.cli.console import CommandResult, command, complain, table
from robojackson.cli.options import Json, Robot, SetStudy, overrides_from, yaml_text


@command
def ablation(
    study: Annotated[
        str, typer.Argument(help="Name of configs/studies/*.yaml, or a path.")
    ] = "paper",
    moves: Annotated[list[str] | None, typer.Option("--move", help="Only this move.")] = None,
    setups: Annotated[list[str] | None, typer.Option("--setup", help="Only this setup.")] = None,
    seeds: Annotated[list[int] | None, typer.Option("--seed", help="Only this seed.")] = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Control steps of a training.")] = None,
    executor: Annotated[
        Literal["local", "work-pool"] | None,
        typer.Option(help="Processes of this machine, or runs that workers take."),
    ] = None,
    slots: Annotated[int | None, typer.Option(min=1, help="Trainings at once.")] = None,
    robot: Robot = None,
    set_: SetStudy = None,
    as_json: Json = False,
) -> CommandResult:
    """Train and evaluate moves x setups x seeds, and write a page that compares them."""
    from flows.cli.verdicts import ablation_verdict
    from flows.runtime.environment import prepare
    from flows.runtime.temporary_server import temporary_server
    from flows.study.study_plan import study_of
    from robojackson.cli.cards import closing
    from storage.store import Store

    given: dict[str, Any] = {"moves": moves, "setups": setups, "seeds": seeds}
    given |= {"steps": steps, "executor": executor, "slots": slots, "robot": yaml_text(robot)}
    requested = study_of(study, overrides_from(set_, given))
    prepare(Store.from_environment())
    with temporary_server():
        from flows.ablation import run

        made = run(requested)
    from tasks.write_study_page import LEAST_STEPS

    shortest = min(map(requested.steps_of, requested.moves))
    made |= ablation_verdict(made, shortest, len(requested.seeds), LEAST_STEPS)
    where = [f"page    {made['page']}", f"tables  {made['tables']}"]
    return CommandResult(made, text=[*where, *closing(made)])


@command
def metrics(
    sql: Annotated[
        str | None,
        typer.Option(help="A question in SQL about `episodes`, `evaluations`, `beats` and `runs`."),
    ] = None,
    as_json: Json = False,
) -> CommandResult:
    """Query the tables of all studies; without --sql, show one line a cell."""
    from flows.cli.verdicts import metrics_verdict
    from robojackson.cli.cards import closing
    from storage import study_tables
    from storage.store import Store
    from storage.study_overview import OVERVIEW

    rows = study_tables.query(Store.from_environment(), OVERVIEW if sql is None else sql)
    if not rows:
        words = "no rows; `robojackson ablation` makes some" if sql is None else "no rows"
        return CommandResult({"rows": []}, text=[words])
    text = table({str(n): row for n, row in enumerate(rows, 1)}, tuple(rows[0]))
    if sql is not None:
        return CommandResult({"rows": rows}, text=text)
    if any(row["strict_success"] is None for row in rows):
        text.append("-: too short to evaluate, or bodies that do not dance succeed as well")
    verdict = metrics_verdict(rows)
    return CommandResult({"rows": rows, **verdict}, text=[*text, *closing(verdict)])


@command
def deploy(
    wait: Annotated[
        float, typer.Option(min=0, help="Seconds to wait for a server that was just started.")
    ] = 0.0,
    as_json: Json = False,
) -> CommandResult:
    """Register pools, deployments and automations with the server of PREFECT_API_URL."""
    from flows.cli.verdicts import deploy_verdict
    from flows.runtime.deployments import deploy as register
    from robojackson.cli.cards import closing
    from robojackson.cli.console import lines

    made = register(wait)
    made |= deploy_verdict(made)
    shown = {name: made[name] for name in ("pools", "automations", "deployments")}
    return CommandResult(made, text=[*lines(shown), *closing(made)])


@command
def server(
    host: Annotated[
        str,
        typer.Option(
            envvar="PREFECT_SERVER_API_HOST", help="Where to listen; 0.0.0.0 is every network."
        ),
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(envvar="PREFECT_SERVER_API_PORT", min=1, max=65535)] = 4200,
    as_json: Json = False,
) -> CommandResult:
    """Start Prefect's server and pages, with the results of the store; Ctrl-C ends it."""
    from flows.runtime.environment import prepare_server
    from storage.store import Store

    store = Store.from_environment()
    prepare_server(store)
    from flows.runtime.result_server import netloc, serve

    address = f"http://{netloc(host, port)}"
    complain(f"pages {address}, PREFECT_API_URL={address}/api")
    serve(store, host, port)
    return CommandResult({"store": store.root}, text=[])
