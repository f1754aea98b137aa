"""One cell of an ablation: a training, its judgement, its rows. Here or on any other machine.

Entry point of the deployment `cell/pool`: `flows.cells.cell`.
"""

from functools import cache
from typing import Any

from prefect import flow
from prefect.deployments import arun_deployment
from pydantic import TypeAdapter

from configs.loader import load
from flows.ending import Ending
from flows.tracebacks import without_tracebacks
from robojackson.errors import TrainingCrashed
from robojackson.retarget.robot import RobotDescription
from storage.artifact import Artifact
from storage.leftovers import sweep
from storage.store import Store
from tasks.cell import Cell
from tasks.judgement import judge
from tasks.kept import kept
from tasks.metrics import publish
from tasks.process import was_killed
from tasks.train import RunLabels, run_id_of, train

DEPLOYMENT = "cell/pool"
SECONDS_BEFORE_RETRY = 2
Result = dict[str, Artifact]
ENDING = Ending()
"""Of the runs on workers that this process waits for."""


@flow(name="cell", flow_run_name="{cell.name}")
async def cell(cell: Cell) -> Result:
    """Train, judge, publish; what was done before is cached.

    Args:
        cell: What to train, on which motion.
    """
    without_tracebacks()
    store = Store.from_environment()
    sweep(store, parts=False)
    robot = _robot(cell.robot)
    labels = RunLabels(cell.move, cell.setup)
    again: dict[str, Any] = {
        "retries": cell.retries,
        "retry_delay_seconds": SECONDS_BEFORE_RETRY,
        "retry_condition_fn": was_killed,
    }
    limit_s = 60 * cell.timeout_minutes
    trained = await train.with_options(**again)(
        cell.reference, robot, cell.train, labels, limit_s=limit_s
    )
    judged = await judge.with_options(**again)(
        trained["policy"], cell.reference, robot, cell.evaluate, limit_s=limit_s
    )
    run_id = run_id_of(cell.reference, robot, cell.train, labels)
    written = publish(cell, run_id, {**trained, **judged})
    sweep(store, parts=False)
    return {**trained, **judged, **written}


@cache
def _robot(name: str) -> RobotDescription:
    """Read once for all the cells of a process."""
    return load(RobotDescription, f"robots/{name}")


async def here(wanted: Cell) -> Result:
    """The cell as a subflow of the flow that calls.

    Raises:
        Exception: whatever the cell failed of.
    """
    return await cell(wanted)


async def anywhere(wanted: Cell) -> Result:
    """The cell as a run that a worker of the pool takes; another one, if the worker dies with it.

    One that was done before is read here: a worker would take seconds to start for nothing.

    Raises:
        TrainingCrashed: it did not end well; a failed child does not raise by itself.
    """
    if await is_kept(wanted):
        return await here(wanted)
    plain = TypeAdapter(Cell).dump_python(wanted, mode="json")
    for _ in range(1 + wanted.retries):
        begun = await arun_deployment(
            DEPLOYMENT, parameters={"cell": plain}, flow_run_name=wanted.name, timeout=0
        )
        run = await ENDING.of(begun)
        if run.state is None or not run.state.is_crashed():
            break
    if run.state is None or not run.state.is_completed():
        said = "has no state" if run.state is None else f"{run.state.name}: {run.state.message}"
        raise TrainingCrashed(f"{wanted.name} on a worker: {said}")
    return TypeAdapter(Result).validate_python(await run.state.aresult())


async def is_kept(wanted: Cell) -> bool:
    """Whether everything that takes time was done before and is still there."""
    robot = _robot(wanted.robot)
    trained = await kept(train, reference=wanted.reference, robot=robot, config=wanted.train)
    if trained is None:
        return False
    given = {"reference": wanted.reference, "robot": robot, "config": wanted.evaluate}
    return await kept(judge, policy=trained["policy"], **given) is not None


EXECUTORS: dict[str, Any] = {"local": here, "work-pool": anywhere}
