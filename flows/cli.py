"""The `robojackson` command.

Every command imports what it needs inside itself, so that the one-stage commands run with no
Prefect in memory and `--help` answers at once.
"""

import os
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from flows.console import Answer, command, log_to_stderr
from robojackson.errors import BadConfiguration

app = typer.Typer(
    name="robojackson",
    help="A video of a dance in, a robot that dances it out.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Config = Annotated[str, typer.Option("--config", help="Name or path of a configuration.")]
Set = Annotated[
    list[str] | None, typer.Option("--set", help="Change one value: --set train.seed=3.")
]
Folder = Annotated[Path, typer.Option("-o", "--out", help="Folder for the results.")]
Robot = Annotated[str, typer.Option("--robot", help="Name of a robot of configs/robots.")]
Trainer = Annotated[
    Literal["sbx", "sb3"] | None, typer.Option(help="sbx (JAX, fast) or sb3 (the reference).")
]
Seed = Annotated[int | None, typer.Option(min=0, help="Seed of the training.")]
Minutes = Annotated[float | None, typer.Option(min=0.01, help="Wall time, minutes.")]


@app.command()
@command
def dance(
    source: Annotated[
        str | None,
        typer.Argument(help="A video, a folder of candidates, or the name of a dance to look for."),
    ] = None,
    minutes: Minutes = None,
    robot: Annotated[str | None, typer.Option("--robot", help="Name of a robot.")] = None,
    trainer: Trainer = None,
    seed: Seed = None,
    start: Annotated[float | None, typer.Option(min=0, help="Trim: begin here, seconds.")] = None,
    end: Annotated[float | None, typer.Option(min=0, help="Trim: end here, seconds.")] = None,
    config: Config = "base",
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """A video in, a robot that dances it out: every stage, cached, and a page at the end."""
    from flows.environment import prepare
    from flows.single import verdict_lines
    from flows.source import is_name, resolve
    from storage.store import Store

    found = None if is_name(source) else resolve(source)
    store = Store.from_environment()
    store.require_writable()
    prepare(store)
    from flows.dance import run

    if found is None:
        from flows.find import clip_of

        found = clip_of(str(source))

    given = {"minutes": minutes, "robot": robot, "train.trainer": trainer, "train.seed": seed}
    made = run(found, config, _overrides(set_, given), start, end)
    text = [*verdict_lines(made["evaluation"]), f"page   {made['page']}", f"video  {made['video']}"]
    return Answer(made, text=text)


@app.command()
@command
def find(
    query: Annotated[str, typer.Argument(help="A dance; or the folder, or list, of the source.")],
    top: Annotated[int | None, typer.Option(min=1, help="How many videos to judge.")] = None,
    source: Annotated[str, typer.Option(help="youtube, folder, urls, site or server.")] = "youtube",
    address: Annotated[
        str, typer.Option(help="Of the folder, list, site ({query} stands for it) or server.")
    ] = "",
    config: Annotated[str, typer.Option(help="Name or path of a configuration.")] = "finding",
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """The videos of a dance, ranked: Algorithm 1, and why others are rejected."""
    from flows import ranking
    from flows.environment import prepare
    from storage.store import Store

    store = Store.from_environment()
    store.require_writable()
    prepare(store)
    from flows.find import look_for

    found = look_for(query, source, address, top, config, _overrides(set_))
    return Answer(found, text=[*ranking.lines(found["candidates"]), found["summary"]])


@app.command()
@command
def refresh(
    dances: Annotated[
        list[str] | None, typer.Argument(help="Names in configs/dances.yaml; else all that are due")
    ] = None,
    config: Annotated[str, typer.Option(help="Configuration of the search.")] = "finding",
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """The nightly run, now: for every dance the best new video, up to the robot's motion."""
    from flows.environment import prepare
    from storage.store import Store

    store = Store.from_environment()
    store.require_writable()
    prepare(store)
    from flows.refresh import run

    done = run(dances or None, config, _overrides(set_))
    return Answer(done, code=1 if done["failed"] and not done["dances"] else 0)


@app.command()
@command
def catalogue(
    dance: Annotated[str | None, typer.Option(help="Only this dance.")] = None,
    sql: Annotated[
        str | None, typer.Option(help="A question to DuckDB about the table `candidates`.")
    ] = None,
    as_json: Json = False,
) -> Answer:
    """Every video that was ever judged, and why it was danced or not."""
    from flows import console, ranking
    from storage import candidates
    from storage.store import Store

    log_to_stderr()
    store = Store.from_environment()
    if sql is not None:
        found = candidates.query(store, sql)
        named = {str(number): row for number, row in enumerate(found, 1)}
        return Answer({"rows": found}, text=console.table(named, list(found[0]) if found else []))
    rows = candidates.records(store, dance)
    return Answer({"candidates": rows}, text=ranking.lines(rows))


@app.command()
@command
def score(
    video: Annotated[list[Path], typer.Argument(help="Videos, or folders of them.")],
    config: Config = "base",
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """How steady the dancer is seen (Algorithm 1): missing joints plus jitter, lowest is best."""
    from flows import single

    log_to_stderr()
    return Answer(single.score(video, config, _overrides(set_)))


@app.command()
@command
def mocap(
    video: Annotated[Path, typer.Argument(help="A video of one person.")],
    out: Folder,
    config: Config = "base",
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """The motion of the person in a video: landmarks.parquet and smpl.parquet."""
    from flows import single

    log_to_stderr()
    return Answer(single.mocap(video, out, config, _overrides(set_)))


@app.command()
@command
def retarget(
    smpl: Annotated[Path, typer.Argument(help="smpl.parquet of `robojackson mocap`.")],
    out: Folder,
    robot: Robot = "humanoid",
    method: Annotated[
        Literal["optimise", "paper"] | None, typer.Option(help="Ours, or the paper's Table I.")
    ] = None,
    config: Config = "base",
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """The same motion for a robot: reference.parquet and scorecard.json."""
    from flows import single

    log_to_stderr()
    overrides = _overrides(set_, {"retarget.method": method})
    return Answer(single.retarget(smpl, out, robot, config, overrides))


@app.command()
@command
def train(
    reference: Annotated[Path, typer.Argument(help="reference.parquet of `robojackson retarget`.")],
    out: Folder,
    trainer: Trainer = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Control steps in all.")] = None,
    minutes: Minutes = None,
    seed: Seed = None,
    setup: Annotated[
        str | None, typer.Option(help="Path of a training configuration, or setups/NAME.")
    ] = None,
    run_id: Annotated[str, typer.Option(help="Name of the run in the tables.")] = "",
    move: Annotated[str, typer.Option(help="Name of the dance in the tables.")] = "",
    parent: Annotated[int, typer.Option(hidden=True, help="End with this process.")] = 0,
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """Teach the robot the motion: policy.safetensors and episodes.parquet; resumes by itself."""
    from flows import training

    if parent:
        training.die_with(parent)
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    log_to_stderr()
    given = {"trainer": trainer, "steps": steps, "minutes": minutes, "seed": seed}
    return Answer(training.train(reference, out, setup, _overrides(set_, given), run_id, move))


@app.command()
@command
def evaluate(
    policy: Annotated[Path, typer.Argument(help="policy.safetensors of `robojackson train`.")],
    reference: Annotated[Path, typer.Argument(help="The reference.parquet it was trained on.")],
    seconds: Annotated[float | None, typer.Option(min=0.1, help="Length of a rollout, s.")] = None,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Folder for the tables.")] = None,
    config: Config = "base",
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """Judge a policy on stock physics from many starts, beside baselines that do not dance."""
    from flows import single

    os.environ.setdefault("OMP_NUM_THREADS", "1")
    log_to_stderr()
    overrides = _overrides(set_, {"evaluate.seconds": seconds})
    judged = single.evaluate(policy, reference, out, config, overrides)
    return Answer(judged, text=single.verdict_lines(judged))


@app.command()
@command
def doctor(as_json: Json = False) -> Answer:
    """What is installed, what is missing, and how to get it."""
    from flows.doctor import examine

    report = examine()
    return Answer(report, code=0 if report["ok"] else 1)


def main() -> None:
    """Entry point of the console script."""
    app()


def _overrides(pairs: list[str] | None, given: dict[str, Any] | None = None) -> dict[str, Any]:
    """`--set key=value` pairs and options that were given, as one mapping."""
    overrides = {key: value for key, value in (given or {}).items() if value is not None}
    for pair in pairs or []:
        key, equals, value = pair.partition("=")
        if not equals or not key:
            raise BadConfiguration(f"--set {pair}: expected KEY=VALUE, such as train.seed=3")
        overrides[key] = value
    return overrides


if __name__ == "__main__":
    main()
