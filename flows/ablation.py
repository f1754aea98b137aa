"""The paper's experiment: moves x setups x seeds, each a subflow that leaves rows in the tables.

Entry point of the deployments `ablation/paper` and `ablation/smoke`: `flows.ablation.ablation`. One
cell that fails leaves the others and the tables whole; the run then ends Failed and names it. The
same run again computes only what is missing.
"""

import asyncio
import json
from collections.abc import Mapping
from dataclasses import replace
from textwrap import shorten
from typing import Any

from prefect import flow
from prefect.context import SyncClientContext
from prefect.logging import get_run_logger

from configs.study_config import Move, Study
from flows.cells import DEPLOYMENT, EXECUTORS
from flows.runtime.launch import launch
from flows.runtime.prefect_server import require_deployment
from flows.runtime.run_artifacts import show_study
from flows.runtime.tracebacks import without_tracebacks
from flows.study.progress_table import ProgressTable
from flows.study.study_plan import trainings_of
from flows.video_pass.motion_stages import to_reference
from robojackson.errors import RejectedReference, StudyFailed
from robojackson.files.processor_cores import cores
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.yaml_loader import load
from robojackson.retarget.scorecard_gate import check
from robojackson.rl.config.train_config import TrainConfig
from storage import study_tables
from storage.artifact import Artifact
from storage.leftovers import sweep
from storage.store import Store
from tasks.audit_rewards import audit_rewards
from tasks.draw_pictures import draw_still
from tasks.probe_video import SourceFile, probe_video
from tasks.runtime.stage import labelled
from tasks.study_cell import Cell
from tasks.write_study_page import write_study_page

Facts = dict[str, Any]
REASON = 200
"""Characters of why a cell failed."""


def run(study: Study) -> Facts:
    """Return the flow from the command line.

    Raises:
        DeploymentFailed: the server that is named does not answer, or refuses us.
        Interrupted: Ctrl-C; what has ended is cached, and no process is left.
    """
    return launch(ablation, study)


@flow(name="ablation", flow_run_name="{study.name}")
async def ablation(study: Study) -> Facts:
    """Train and evaluate every cell, then write the page of the study.

    Args:
        study: What is compared with what.
    Raises:
        UnknownName, BadConfiguration: a move or setup does not exist; no cell was started.
        BadPolicy: a setup starts from a walker and the robot has none; no cell was started.
        RejectedReference: the gate refuses motions; no cell was started.
        DeploymentFailed: its cells are for workers, and no deployment takes them; nothing was made.
        StudyFailed: cells failed; the message names each.
    """
    without_tracebacks()
    if study.executor == "work-pool":
        await require_deployment(DEPLOYMENT)
    sweep(Store.from_environment())
    moves = {name: load(Move, f"moves/{name}") for name in study.moves}
    trainings = trainings_of(study, describe_robot(study.robot))
    with SyncClientContext.get_or_create():  # one connection for all stages of all motions
        motions = {name: motion(name, move, study, trainings) for name, move in moves.items()}
    cells = cells_of(study, {n: made["reference"] for n, made in motions.items()}, trainings)
    gate(study, {name: made["scorecard"] for name, made in motions.items()})
    board = ProgressTable(study, cells)
    slots = asyncio.Semaphore(study.slots or _slots(study))
    execute = EXECUTORS[study.executor]

    async def one(each: Cell) -> Any:
        async with slots:
            board.running(each)
            try:
                made = await execute(each)
                board.done(each, made)
            except Exception as cause:
                board.failed(each, _line(cause))
                raise
            return made

    async with board.shown():
        results = await asyncio.gather(*(one(c) for c in cells), return_exceptions=True)
    outcomes = dict(zip((c.name for c in cells), results, strict=True))
    return await conclude(study, moves, outcomes, motions)


def motion(
    name: str, move: Move, study: Study, trainings: Mapping[str, TrainConfig]
) -> dict[str, Artifact]:
    """Make what a move is trained on and shown with; every stage cached.

    Args:
        name: Name of the move; its task runs are named after it.
    Returns:
        `reference` and `scorecard`; `still`, its picture; `reward_audits`, what the rewards of the
        setups pay to bodies that do not dance it.
    """
    settings = load(PipelineConfig, study.pipeline, move.overrides)
    robot = describe_robot(study.robot)
    rewards = {setup: train.environment for setup, train in trainings.items()}
    with labelled(name):
        clip = probe_video(SourceFile.at(move.path), settings.video, None, None)
        moved = to_reference(clip, robot, settings)
        seen = (clip["video"], moved["landmarks"], moved["smpl"], moved["reference"])
        return {name: moved[name] for name in ("reference", "scorecard")} | {
            "still": draw_still(*seen, robot),
            "reward_audits": audit_rewards(moved["reference"], robot, rewards),
        }


def gate(study: Study, scorecards: Mapping[str, Artifact]) -> None:
    """Refuse motions that no robot can follow, or log that they are trained on anyway.

    Raises:
        RejectedReference: the message names each and the figure that failed.
    """
    store = Store.from_environment()
    refused = []
    for name, scorecard in scorecards.items():
        try:
            check(json.loads(store.read(scorecard.key)))
        except RejectedReference as cause:
            refused.append(f"{name}: {cause.without_force}")
    if not refused:
        return
    summary = f"study {study.name}: {len(refused)} of {len(scorecards)} motions are refused"
    if study.gate:
        raise RejectedReference(
            f"{summary} ({'; '.join(refused)}). No cell was started; `gate: false` "
            "(--set gate=false) trains on them anyway"
        )
    get_run_logger().warning("%s and trained on: %s", summary, "; ".join(refused))


def cells_of(
    study: Study, references: Mapping[str, Artifact], trainings: Mapping[str, TrainConfig]
) -> list[Cell]:
    """Return every move x setup x seed, seed by seed, so that an early look compares like with
    like."""
    evaluate = load(PipelineConfig, study.pipeline).evaluate
    return [
        Cell(
            study=study.name,
            move=name,
            setup=setup,
            seed=seed,
            reference=references[name],
            robot=study.robot,
            train=replace(trainings[setup], seed=seed, steps=study.steps_of(name)),
            evaluate=evaluate,
            timeout_minutes=study.timeout_minutes,
            retries=study.retries,
        )
        for seed in study.seeds
        for name in study.moves
        for setup in study.setups
    ]


async def conclude(
    study: Study,
    moves: dict[str, Move],
    outcomes: Mapping[str, Any],
    motions: Mapping[str, dict[str, Artifact]],
) -> Facts:
    """Write the page of the successful cells, and raise one sentence about the failed ones.

    Raises:
        StudyFailed: a cell failed.
    """
    failed = {n: _line(r) for n, r in outcomes.items() if isinstance(r, BaseException)}
    store = Store.from_environment()
    well = [result["episodes"] for n, result in outcomes.items() if n not in failed]
    made = {}
    if well:
        rows = study_tables.files_of(store, study.name, study_tables.runs_of(well))
        stills, paid = (
            {n: made[w] for n, made in motions.items()} for w in ("still", "reward_audits")
        )
        made = write_study_page(study, moves, rows, stills, paid)
        await show_study(store, study.name, made)
    if failed:
        named = "; ".join(f"{name}: {reason}" for name, reason in failed.items())
        raise StudyFailed(
            f"{len(failed)} of {len(outcomes)} cells failed ({named}). "
            "The others are in the tables; the same run again does only what is missing"
        )
    get_run_logger().info("study %s: %s", study.name, store.address(made["page"].key))
    return {
        "study": study.name,
        "cells": len(outcomes),
        "page": store.address(made["page"].key),
        "tables": store.address(f"metrics/episodes/study={study.name}"),
    }


def _slots(study: Study) -> int:
    """Return the cores of this machine; a pool's workers set their own limits."""
    if study.executor == "work-pool":
        return 10_000
    return cores()


def _line(cause: BaseException) -> str:
    """Return why a cell failed; some errors of Prefect have no message but "None"."""
    said = shorten(str(cause), REASON, placeholder=" ...")
    return type(cause).__name__ if said in ("", "None") else said
