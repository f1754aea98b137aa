"""One cell of an ablation: a training, its evaluation, its rows. Here or on another machine.

Entry point of the deployment `cell/pool`: `flows.cells.cell`.
"""

import asyncio
import time
from collections.abc import Awaitable, Callable
from dataclasses import replace
from functools import cache
from typing import Any

from prefect import flow
from prefect.client.schemas.objects import FlowRun
from prefect.deployments import arun_deployment
from pydantic import TypeAdapter

from flows.runtime.tracebacks import without_tracebacks
from flows.study.run_watcher import RunWatcher
from robojackson.errors import TrainingCrashed, TrainingFailed
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.robot.model import RobotDescription
from storage.leftovers import sweep
from storage.store import Store
from tasks.evaluate_policy import evaluate_policy
from tasks.publish_tables import Result, publish, published
from tasks.runtime.stage import labelled
from tasks.study_cell import Cell
from tasks.train_policy import RunLabels, run_id_of, train_policy

DEPLOYMENT = "cell/pool"
SECONDS_BEFORE_RETRY = 2.0
SHORTEST_S = 1.0
"""What a stage gets after the deadline: nothing can be done in it, but what is cached is read."""
WATCHER = RunWatcher()
"""Of the runs on workers that this process waits for."""


@flow(name="cell", flow_run_name="{cell.name}")
async def cell(cell: Cell) -> Result:
    """Train, evaluate, publish; what was done before is cached.

    Args:
        cell: What to train, on which motion.
    Raises:
        TrainingFailed: a process failed, was killed too often, or the time of the cell is over.
    """
    deadline = time.monotonic() + 60 * cell.timeout_minutes
    without_tracebacks()
    store = Store.from_environment()
    sweep(store, parts=False)
    robot = _robot(cell.robot)
    labels = RunLabels(cell.move, cell.setup)
    with labelled(cell.name):
        trained = await with_retries(
            lambda s: train_policy(cell.reference, robot, cell.train, labels, limit_s=s),
            cell,
            deadline,
        )
        policy = trained["policy"]
        evaluated = await with_retries(
            lambda s: evaluate_policy(policy, cell.reference, robot, cell.evaluate, limit_s=s),
            cell,
            deadline,
        )
    made = publish(cell, _run_id(cell), {**trained, **evaluated})
    sweep(store, parts=False)
    return made


async def with_retries(
    stage: Callable[[float], Awaitable[Result]], cell: Cell, deadline: float
) -> Result:
    """Return a stage of a cell, again when its process was killed; an attempt gets the time that is
    left.

    Prefect's own retries would give every attempt the time of the first.

    Args:
        stage: Function that runs it, given its limit in seconds.
        deadline: At which the cell has failed, by the monotonic clock, seconds.
    Raises:
        TrainingFailed: its process failed, was killed too often, or the deadline has come.
    """
    for tries_left in range(cell.retries, -1, -1):
        try:
            return await stage(max(deadline - time.monotonic(), SHORTEST_S))
        except TrainingFailed as cause:
            if time.monotonic() >= deadline:
                reason = f"{cell.name} did not end within {cell.timeout_minutes:g} minutes"
                raise TrainingFailed(f"{reason}: {cause}") from cause
            if not tries_left or not isinstance(cause, TrainingCrashed):
                raise
        await asyncio.sleep(SECONDS_BEFORE_RETRY)
    raise AssertionError("unreachable")


@cache
def _robot(name: str) -> RobotDescription:
    """Read once for all the cells of a process."""
    return describe_robot(name)


async def run_locally(requested: Cell) -> Result:
    """Return the cell as a subflow of the flow that calls.

    Raises:
        Exception: the failure of the cell.
    """
    return await cell(requested)


async def run_on_worker(requested: Cell) -> Result:
    """Return the cell as a run that a worker of the pool takes; another one, if the worker dies
    with it.

    One that was done before is read here: a worker would take seconds to start for nothing.

    Its result is read from the store: Prefect's own results do not reach another process on every
    store.

    Raises:
        CancelledError: the study is cancelled, and its run with it, unless a worker has begun it.
        TrainingCrashed: it did not end well; a failed child does not raise by itself.
        StoreError: it ended well and left nothing in this store; the message names why.
    """
    if await asyncio.to_thread(is_recorded, requested):
        return await run_locally(requested)
    left_s = 60 * requested.timeout_minutes
    for _ in range(1 + requested.retries):
        given = replace(requested, timeout_minutes=left_s / 60)
        plain = TypeAdapter(Cell).dump_python(given, mode="json")
        run = await _ended_on_worker(requested.name, plain)
        left_s -= run.total_run_time.total_seconds()
        if run.state is None or not run.state.is_crashed() or left_s <= 0:
            break
    if run.state is None or not run.state.is_completed():
        said = "has no state" if run.state is None else f"{run.state.name}: {run.state.message}"
        raise TrainingCrashed(f"{requested.name} on a worker: {said}")
    return await asyncio.to_thread(published, requested, _run_id(requested))


async def _ended_on_worker(name: str, plain: dict[str, Any]) -> FlowRun:
    """Return a run of a cell as it ended on a worker."""
    creating: asyncio.Task[FlowRun] = asyncio.create_task(
        arun_deployment(DEPLOYMENT, parameters={"cell": plain}, flow_run_name=name, timeout=0)
    )
    try:
        begun = await asyncio.shield(creating)
    except asyncio.CancelledError:
        await WATCHER.cancel((await creating).id)
        raise
    return await WATCHER.of(begun)


def is_recorded(requested: Cell) -> bool:
    """Return whether everything that takes time was done before and is still in the store."""
    given = (requested.reference, _robot(requested.robot))
    trained = train_policy.recorded(*given, requested.train)
    if trained is None:
        return False
    return evaluate_policy.recorded(trained["policy"], *given, requested.evaluate) is not None


def _run_id(requested: Cell) -> str:
    labels = RunLabels(requested.move, requested.setup)
    return run_id_of(requested.reference, _robot(requested.robot), requested.train, labels)


EXECUTORS: dict[str, Any] = {"local": run_locally, "work-pool": run_on_worker}
