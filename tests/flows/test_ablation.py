"""An ablation whose cells are played: failures, queues, restarts and what is reported."""

import asyncio
import json
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import AsyncMock

import pytest
import yaml
from prefect import State
from prefect.client.orchestration import get_client
from prefect.client.schemas.filters import ArtifactFilter, ArtifactFilterKey
from prefect.exceptions import ParameterTypeError
from prefect.states import Completed, Crashed, Failed, Running

from configs.study_config import Setup, Study
from flows import ablation, cells
from flows.study import run_watcher
from robojackson.errors import (
    BadConfiguration,
    DeploymentFailed,
    RejectedReference,
    StudyFailed,
    TrainingCrashed,
    TrainingFailed,
)
from robojackson.pipeline.yaml_loader import load
from robojackson.retarget.scorecard_gate import BARS
from robojackson.rl.config.train_config import EvaluateConfig, TrainConfig
from storage.artifact import Artifact
from storage.store import Store
from tasks.study_cell import Cell

ROOT = Path(__file__).parents[2]
SETUPS: tuple[Setup, ...] = ("scratch", "pretrain", "curiosity")
REFERENCE = Artifact(key="retarget/reference.parquet", sha256="0" * 64)

EPISODES = "metrics/episodes/study=played/{}.parquet"


class Played:
    """An executor of cells that takes a moment, and fails where it has to."""

    def __init__(self, fails: str = "") -> None:
        self.fails, self.now, self.most = fails, 0, 0

    async def __call__(self, cell: Cell) -> dict[str, Artifact]:
        self.now += 1
        self.most = max(self.most, self.now)
        await asyncio.sleep(0.05)
        self.now -= 1
        if cell.name == self.fails:
            raise TrainingCrashed("run x was killed by SIGKILL")
        store, summary = Store.from_environment(), {"survived_s": 1.25, "skill": 0.5}
        return {
            "evaluation": store.put("evaluation.json", json.dumps(summary).encode()),
            "episodes": store.put(EPISODES.format(cell.name), b"rows"),
        }


@pytest.fixture
def play(
    records: None, store_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., dict[str, Any]]:
    """Run the flow with played cells, motions and page; the motions and the page are not ours."""
    page = Store(store_folder).put("studies/index.html", b"page")
    table = Store(store_folder).put("studies/table.csv", b"")
    results = Store(store_folder).put("studies/results.json", b'{"claims": []}')
    still = Store(store_folder).put("still.png", b"png")
    motions = {"reference": REFERENCE, "still": still, "reward_audits": still}

    def motion(name: str, move: object, study: Study, trainings: object) -> dict[str, Artifact]:
        card = json.dumps(dict.fromkeys(BARS, 0.0) | {"infeasible_share": infeasible})
        return motions | {"scorecard": Store(store_folder).put("card.json", card.encode())}

    def results_page(
        study: Study, moves: object, rows: list[Artifact], stills: object, payments: object
    ) -> dict[str, Artifact]:
        run.shown = {row.name for row in rows}  # type: ignore[attr-defined]
        return {"page": page, "table": table, "results": results}

    infeasible = 0.0
    monkeypatch.setattr(ablation, "motion", motion)
    monkeypatch.setattr(ablation, "write_study_page", results_page)

    def run(executor: Played, infeasible_share: float = 0.0, **given: Any) -> dict[str, Any]:
        nonlocal infeasible
        infeasible = infeasible_share
        monkeypatch.setitem(ablation.EXECUTORS, "local", executor)
        study = Study(name="played", moves=("walk",), setups=SETUPS, seeds=(0,), **given)
        return asyncio.run(ablation.ablation(study))

    return run


def states_reported() -> dict[str, str]:
    """Return the last version of the table on Prefect's page: states by cell."""
    with get_client(sync_client=True) as client:
        expected = ArtifactFilter(key=ArtifactFilterKey(any_=["ablation-played"]))
        versions = client.read_artifacts(artifact_filter=expected)
    newest = max(versions, key=lambda version: str(version.created))
    return {row["cell"]: row["state"] for row in json.loads(str(newest.data))}


@pytest.mark.medium
def test_a_failed_cell_is_named_and_its_neighbours_are_done(play: Any) -> None:
    with pytest.raises(StudyFailed, match=r"1 of 3 cells failed \(pretrain-walk-s0: run x was"):
        play(Played(fails="pretrain-walk-s0"))
    facts = {"scratch-walk-s0": "done", "pretrain-walk-s0": "failed", "curiosity-walk-s0": "done"}
    assert states_reported() == facts


@pytest.mark.medium
def test_the_page_is_of_the_cells_that_ended_well_in_this_run(
    play: Any, store_folder: Path
) -> None:
    """Rows of a cell that failed this time, and of another day's seeds, are in the tables, too."""
    for earlier in ("pretrain-walk-s0", "scratch-walk-s7"):
        Store(store_folder).put(EPISODES.format(earlier), b"rows")
    with pytest.raises(StudyFailed):
        play(Played(fails="pretrain-walk-s0"))
    assert play.shown == {"scratch-walk-s0.parquet", "curiosity-walk-s0.parquet"}


@pytest.mark.medium
def test_a_study_on_a_refused_motion_begins_no_cell_and_says_why(play: Any) -> None:
    executor = Played()
    result = r"1 of 1 motions are refused \(walk: .*infeasible_share is 0.5.*gate=false"
    with pytest.raises(RejectedReference, match=result):
        play(executor, infeasible_share=0.5)
    assert executor.most == 0


@pytest.mark.medium
def test_a_study_without_a_gate_trains_on_a_refused_motion(play: Any) -> None:
    assert play(Played(), infeasible_share=0.5, gate=False)["cells"] == 3


@pytest.mark.medium
def test_no_more_cells_run_at_once_than_there_are_slots(play: Any) -> None:
    executor = Played()
    assert play(executor, slots=2)["cells"] == 3
    assert executor.most == 2


@pytest.mark.parametrize(
    "wrong",
    [{"setups": ["bogus"]}, {"steps": 0}, {"seeds": []}, {"stepz": 5}, {"seeds": [0, 0]}],
    ids=str,
)
def test_nonsense_is_refused_before_a_run_starts(wrong: dict[str, Any]) -> None:
    with pytest.raises(ParameterTypeError):
        ablation.ablation.validate_parameters({"study": wrong})


@pytest.mark.parametrize(
    ("wrong", "expected_message"),
    [
        ({"seeds": [1, 0, 1]}, r"--set seeds: 'seeds' is \[1, 0, 1\]: 1 is listed twice"),
        ({"moves": ["walk", "walk"]}, "--set moves: .*: walk is listed twice"),
        (
            {"setups": ["scratch", "pretrain", "scratch"]},
            "--set setups: .*: scratch is listed twice",
        ),
    ],
)
def test_a_cell_that_would_stand_twice_in_a_study_is_refused(
    wrong: dict[str, Any], expected_message: str
) -> None:
    with pytest.raises(BadConfiguration, match=expected_message):
        load(Study, "studies/smoke", wrong)


@pytest.mark.parametrize("name", ["paper", "smoke", "g1", "dancer"])
def test_a_deployment_is_the_study_of_its_name_on_workers(name: str) -> None:
    entries = yaml.safe_load((ROOT / "prefect.yaml").read_text())["deployments"]
    (ours,) = [e for e in entries if e["entrypoint"].endswith(".ablation") and e["name"] == name]
    expected = load(Study, f"studies/{name}", {"executor": "work-pool"})
    ours = Study(**ours["parameters"]["study"])
    assert (ours, ours.robot) == (expected, expected.robot)


@pytest.mark.medium
def test_a_study_that_no_worker_can_take_is_refused_before_its_motions(
    records: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ablation, "motion", lambda *given: pytest.fail("a motion was made"))
    study = Study(name="played", moves=("walk",), setups=SETUPS, executor="work-pool")
    with pytest.raises(DeploymentFailed, match="has no deployment cell/pool"):
        asyncio.run(ablation.ablation(study))


@pytest.mark.parametrize("empty", [ValueError(), ValueError(None)], ids=["nothing", "None"])
def test_an_error_without_a_message_is_reported_by_its_name(empty: Exception) -> None:
    assert ablation._line(empty) == "ValueError"


class Pool:
    """A work pool whose runs end in the states that it is given, one after the other."""

    def __init__(self, *states: State[Any], run_minutes: float = 0.0) -> None:
        self.left = list(states)
        self.run_time = timedelta(minutes=run_minutes)
        self.names: list[str] = []
        self.timeouts: list[float] = []

    async def __call__(self, deployment: str, **given: Any) -> SimpleNamespace:
        json.dumps(given["parameters"])
        self.names.append(given["flow_run_name"])
        self.timeouts.append(given["parameters"]["cell"]["timeout_minutes"])
        return SimpleNamespace(id=0, state=self.left.pop(0), total_run_time=self.run_time)


def a_cell(**given: Any) -> Cell:
    names: dict[str, Any] = {"study": "s", "move": "walk", "setup": "scratch", "seed": 0}
    configs: dict[str, Any] = {"train": TrainConfig(steps=100), "evaluate": EvaluateConfig()}
    return Cell(**names, reference=REFERENCE, robot="humanoid", **configs, **given)


def on_workers(
    pool: Pool, monkeypatch: pytest.MonkeyPatch, kept: bool = False
) -> dict[str, Artifact]:
    monkeypatch.setattr(cells, "arun_deployment", pool)
    monkeypatch.setattr(cells, "is_recorded", lambda cell: kept)
    monkeypatch.setattr(cells, "published", lambda cell, run_id: {"policy": REFERENCE})
    monkeypatch.setattr(cells, "run_id_of", lambda *given: "walk-scratch-s0-0")
    monkeypatch.setattr(cells, "run_locally", AsyncMock(return_value={"policy": REFERENCE}))
    return asyncio.run(cells.run_on_worker(a_cell()))


def test_a_cell_that_was_done_before_uses_no_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    pool = Pool()
    assert on_workers(pool, monkeypatch, kept=True) == {"policy": REFERENCE}
    assert pool.names == []


def test_a_cell_whose_worker_died_is_given_to_another(monkeypatch: pytest.MonkeyPatch) -> None:
    pool = Pool(Crashed(message="exit -9"), Completed())
    assert on_workers(pool, monkeypatch) == {"policy": REFERENCE}
    assert pool.names == ["scratch-walk-s0"] * 2


@pytest.mark.parametrize("moment_s", [0.0, 0.1], ids=["being created", "waiting"])
def test_a_cancelled_study_cancels_its_cells(
    moment_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    cancelled = AsyncMock()

    class Slow(Pool):
        async def __call__(self, deployment: str, **given: Any) -> SimpleNamespace:
            started.append(deployment)
            await asyncio.sleep(0.05)
            return SimpleNamespace(id=7, state=Running())

    async def interrupted() -> None:
        running = asyncio.create_task(cells.run_on_worker(a_cell()))
        while not started:
            await asyncio.sleep(0.01)
        await asyncio.sleep(moment_s)
        running.cancel()
        await running

    started: list[str] = []
    monkeypatch.setattr(cells, "arun_deployment", Slow())
    monkeypatch.setattr(cells, "is_recorded", lambda cell: False)
    monkeypatch.setattr(run_watcher, "_cancel_waiting", cancelled)
    with pytest.raises(asyncio.CancelledError):
        asyncio.run(interrupted())
    cancelled.assert_awaited_once_with([7])


def test_a_cell_that_kills_every_worker_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    pool = Pool(*[Crashed(message="exit -9") for _ in range(3)])
    with pytest.raises(TrainingCrashed, match="scratch-walk-s0 on a worker: Crashed: exit -9"):
        on_workers(pool, monkeypatch)


def test_a_cell_that_failed_by_itself_is_not_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    pool = Pool(Failed(message="diverged"))
    with pytest.raises(TrainingCrashed, match="Failed: diverged"):
        on_workers(pool, monkeypatch)
    assert len(pool.names) == 1


def test_a_cell_that_is_given_to_another_worker_gets_the_time_that_is_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pool = Pool(*[Crashed(message="exit -9") for _ in range(3)], run_minutes=130.0)
    with pytest.raises(TrainingCrashed):
        on_workers(pool, monkeypatch)
    assert pool.timeouts == [240.0, 110.0]


KILLED = TrainingCrashed("run x was killed by SIGKILL")


class Attempts:
    """A stage that takes a while and then fails; after all its failures it ends well."""

    def __init__(self, *failures: Exception, seconds: float) -> None:
        self.left, self.seconds, self.now = list(failures), seconds, 0.0
        self.limits: list[float] = []

    async def __call__(self, limit_s: float) -> dict[str, Artifact]:
        self.limits.append(limit_s)
        self.now += self.seconds
        if self.left:
            raise self.left.pop(0)
        return {"policy": REFERENCE}

    def run(self) -> dict[str, Artifact]:
        """Run the stage in a cell of one minute and two retries."""
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(cells, "SECONDS_BEFORE_RETRY", 0.0)
            patch.setattr(cells, "time", SimpleNamespace(monotonic=lambda: self.now))
            cell = a_cell(timeout_minutes=1.0, retries=2)
            return asyncio.run(cells.with_retries(self, cell, deadline=60.0))


def test_each_attempt_gets_the_time_that_the_one_before_it_left() -> None:
    stage = Attempts(KILLED, KILLED, seconds=20.0)
    assert stage.run() == {"policy": REFERENCE}
    assert stage.limits == [60.0, 40.0, 20.0]


def test_a_killed_process_is_not_started_again_after_the_deadline() -> None:
    stage = Attempts(KILLED, KILLED, KILLED, seconds=35.0)
    with pytest.raises(TrainingFailed, match="scratch-walk-s0 did not end within 1 minutes: run x"):
        stage.run()
    assert stage.limits == [60.0, 25.0]


@pytest.mark.parametrize(
    ("failures", "attempts"),
    [([KILLED] * 3, 3), ([TrainingFailed("exit code 1")], 1)],
    ids=["killed again and again", "gave up by itself"],
)
def test_only_a_killed_process_is_started_again_and_not_for_ever(
    failures: list[Exception], attempts: int
) -> None:
    stage = Attempts(*failures, seconds=1.0)
    with pytest.raises(TrainingFailed):
        stage.run()
    assert len(stage.limits) == attempts


def test_training_and_evaluation_share_the_time_of_a_cell(
    store_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits: list[float] = []

    async def stage(*given: Any, limit_s: float) -> dict[str, Artifact]:
        limits.append(limit_s)
        await asyncio.sleep(0.2)
        return {"policy": REFERENCE}

    for name in ("train_policy", "evaluate_policy"):
        monkeypatch.setattr(cells, name, stage)
    monkeypatch.setattr(cells, "run_id_of", lambda *given: "walk-scratch-s0-0")
    monkeypatch.setattr(cells, "publish", lambda *given: {})
    asyncio.run(cells.cell.fn(a_cell(timeout_minutes=1.0)))
    assert 60.0 >= limits[0] >= limits[1] + 0.2
