"""The main flow: a dance in, a robot that dances it out, and a page that shows it.

Entry point of the deployment: `flows.dance.dance`. Which stages run and in which order stands in
`flows.video_pass.dance_stages`; how a stage works is `robojackson`'s, how it is cached is `tasks`'.
"""

from collections.abc import Mapping
from typing import Any

from prefect import flow
from prefect.runtime import flow_run

from flows.runtime.launch import launch
from flows.runtime.run_artifacts import show_dance
from flows.search.scoring_pool import scorers
from flows.video_pass.dance_stages import make_dance
from flows.video_pass.inputs import Minutes, Search, Seconds, Source, name_of, videos_of
from robojackson.cli.options import yaml_text
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.robust_training import robust_dance
from robojackson.pipeline.yaml_loader import load
from storage.leftovers import sweep
from storage.store import Store


def run(
    source: str,
    config: str,
    overrides: Mapping[str, Any],
    start_s: float | None = None,
    end_s: float | None = None,
) -> dict[str, Any]:
    """Run the flow from the command line: no tracebacks for what is the input's fault.

    Raises:
        DeploymentFailed: the server that is named does not answer, or refuses us.
        Interrupted: Ctrl-C; every stage that has ended is kept, and training left a checkpoint.
    """
    return launch(dance, source, config, dict(overrides), start_s, end_s)


def run_name() -> str:
    """Name a run after its dance, wherever the video of it is."""
    return f"dance-{name_of(flow_run.parameters['source'])}"


@flow(name="dance", flow_run_name=run_name, task_runner=scorers())
async def dance(
    source: Source,
    config: str = "base",
    overrides: dict[str, Any] | None = None,
    start_s: Seconds | None = None,
    end_s: Seconds | None = None,
    minutes: Minutes | None = None,
    search: Search = Search(),  # noqa: B008 (frozen)
    robot: str | None = None,
    instant: bool = False,
    robust: bool = False,
) -> dict[str, Any]:
    """Turn the name of a dance, or a video of it, into a robot that dances it.

    Args:
        source: Name of a dance, as APT; or address of a video on the web; or path, where the worker
            is, of a video or of a folder of them, of which the steadiest is danced.
        config: Name or path of the pipeline's configuration.
        overrides: Values of it by key path, as train.seed.
        start_s, end_s: Range of the video, seconds.
        minutes: Budget of the whole pass; that of the configuration if absent.
        search: How a dance is looked for that is given by its name.
        robot: Name of one of configs/robots; or path, where the worker is, of the YAML of your own.
        instant: Whether a tracker (`robojackson trackers`) dances at once and nothing is trained.
        robust: Whether it is trained with varied physics, noise and pushes, and gets a passport.
    """
    store = Store.from_environment()
    sweep(store, work=False)
    given: dict[str, Any] = {"minutes": minutes, "robot": yaml_text(robot)}
    given["instant"] = instant or None
    given = {**(overrides or {}), **{k: v for k, v in given.items() if v is not None}}
    settings = load(PipelineConfig, config, robust_dance(config, given) if robust else given)
    async with videos_of(source, search) as paths:
        done = await make_dance(store, paths, settings, start_s, end_s)
    answer = done.answer
    await show_dance(store, answer["move"], answer["evaluation"], done.artifacts)
    return answer
