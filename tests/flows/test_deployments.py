"""What prefect.yaml deploys."""

import asyncio
import inspect
import os
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import fsspec
import pytest
import yaml
from moto.server import ThreadedMotoServer
from prefect import Flow, flow
from prefect.client.orchestration import get_client
from prefect.client.schemas.actions import WorkPoolCreate
from prefect.workers.process import ProcessJobConfiguration, ProcessWorker

from configs.dance_book import Dance
from flows.runtime import deployments
from flows.runtime.deployments import SILENCE, automations
from flows.runtime.environment import FIXED
from robojackson.errors import DeploymentFailed, SearchFailed
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.stage import stage

ROOT = Path(__file__).parents[2]
DEPLOYMENTS = yaml.safe_load((ROOT / "prefect.yaml").read_text())["deployments"]
DANCE_GB = 4
"""Memory of a pass with training (docs/platforms.md)."""
FREQUENCY = "PREFECT_FLOWS_HEARTBEAT_FREQUENCY"
OLDER = ProcessWorker.get_default_base_job_template()
OLDER["variables"]["properties"]["env"]["default"] = {"CUDA_VISIBLE_DEVICES": "1"}


def flow_of(deployment: dict[str, Any]) -> Flow[Any, Any]:
    module, name = deployment["entrypoint"].rsplit(".", 1)
    found = getattr(import_module(module), name)
    assert isinstance(found, Flow)
    return found


@pytest.mark.parametrize("deployment", DEPLOYMENTS, ids=lambda d: d["name"])
def test_a_deployment_is_a_flow_with_the_parameters_it_gives(deployment: dict[str, Any]) -> None:
    known = inspect.signature(flow_of(deployment).fn).parameters
    assert set(deployment.get("parameters", {})) <= set(known)


def test_missed_nights_do_not_run_at_once() -> None:
    (nightly,) = (each for each in DEPLOYMENTS if each["name"] == "nightly")
    assert nightly["concurrency_limit"] == {"limit": 1, "collision_strategy": "CANCEL_NEW"}


def test_dances_that_train_fit_into_the_memory_of_the_flow_worker() -> None:
    """Each trains in the worker itself; one that comes meanwhile waits."""
    (dance,) = (each for each in DEPLOYMENTS if each["entrypoint"] == "flows.dance.dance")
    assert dance["concurrency_limit"]["collision_strategy"] == "ENQUEUE"
    worker = yaml.safe_load((ROOT / "docker-compose.yml").read_text())["services"]["flow-worker"]
    memory = worker["deploy"]["resources"]["limits"]["memory"]
    (gigabytes,) = re.findall(r"FLOW_WORKER_MEMORY:-(\d+)g", memory)
    assert dance["concurrency_limit"]["limit"] * DANCE_GB <= int(gigabytes)


def test_the_refresh_runs_every_night_and_by_hand() -> None:
    ours = {f"{flow_of(d).name}/{d['name']}": d.get("schedules", []) for d in DEPLOYMENTS}
    assert [schedule["cron"] for schedule in ours["refresh/nightly"]] == ["0 3 * * *"]
    assert ours["refresh/trending-now"] == []


def test_dances_can_be_named_from_outside() -> None:
    nightly = next(d for d in DEPLOYMENTS if d["name"] == "nightly")
    assert flow_of(nightly).validate_parameters({"dances": ["APT"]})["dances"] == ["APT"]


def test_dances_are_requested_by_name() -> None:
    expected = next(d for d in DEPLOYMENTS if d["entrypoint"] == "flows.dance.dance")
    assert flow_of(expected).validate_parameters({"source": "APT"})["source"] == "APT"


@pytest.mark.parametrize(
    ("name", "query"), [("apt", "APT dance rose bruno mars shorts"), ("Lambada", "Lambada")]
)
def test_find_searches_the_dance_of_its_name(
    name: str, query: str, store_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the book, or by its words."""
    (deployed,) = (each for each in DEPLOYMENTS if each["entrypoint"] == "flows.find.find")
    searched: list[Dance] = []

    def far_enough(dance: Dance, *rest: object) -> None:
        searched.append(dance)
        raise SearchFailed("far enough")

    monkeypatch.setattr("flows.find.search_and_rank", far_enough)
    with pytest.raises(SearchFailed, match="far enough"):
        asyncio.run(flow_of(deployed).fn(**{**deployed["parameters"], "name": name}))
    assert [dance.full_query for dance in searched] == [query]


def test_each_deployment_that_moves_a_robot_takes_its_name() -> None:
    """`find` ranks videos, and studies name their robot; `refresh` had no such parameter."""
    flows = {flow_of(deployment) for deployment in DEPLOYMENTS}
    robotless = {f.name for f in flows if "robot" not in inspect.signature(f.fn).parameters}
    assert robotless == {"find", "ablation", "cell"}


def within(**silence: str) -> dict[str, int]:
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv(SILENCE, raising=False)
        for name, value in silence.items():
            patch.setenv(name, value)
        return {facts["name"]: facts["trigger"]["within"] for facts in automations()}


def test_the_silence_of_a_run_can_be_chosen() -> None:
    shipped, quick = within(), within(**{SILENCE: "75"})
    assert quick == {name: seconds / 2 for name, seconds in shipped.items()}


def test_an_automation_names_its_seconds() -> None:
    document = {f["trigger"]["within"]: f["actions"][0]["message"] for f in automations()}
    assert all(f" {seconds} s" in message for seconds, message in document.items())


@pytest.mark.parametrize("seconds", ["60", "-1", "soon"])
def test_a_silence_shorter_than_two_signs_of_life_is_refused(seconds: str) -> None:
    with pytest.raises(DeploymentFailed, match=f"{SILENCE}='{seconds}': whole seconds, 61 at"):
        within(**{SILENCE: seconds})


async def environment_of_a_run(pool: str, known: dict[str, Any] | None) -> dict[str, Any]:
    """Return the environment that a worker gives a run of a pool, which may have been registered
    before."""
    async with get_client() as client:
        if known is not None:
            before = WorkPoolCreate(name=pool, type="process", base_job_template=known)
            await client.create_work_pool(before)
        await deployments._pool(client, pool, "")
        template = (await client.read_work_pool(pool)).base_job_template
    return dict((await ProcessJobConfiguration.from_template_and_values(template, {})).env)


@pytest.mark.medium
@pytest.mark.parametrize(("pool", "known"), [("new", None), ("older", OLDER)])
def test_a_run_of_our_pools_may_miss_two_heartbeats(
    prefect_server: None, pool: str, known: dict[str, Any] | None
) -> None:
    env = asyncio.run(environment_of_a_run(pool, known))
    assert 2 * float(env[FREQUENCY]) < within()["Mark dead runs"]
    assert env.get("CUDA_VISIBLE_DEVICES") == (known and "1")


def test_a_flow_from_the_command_line_may_miss_two_heartbeats() -> None:
    assert 2 * float(FIXED[FREQUENCY]) < within()["Mark dead runs"]


@pytest.fixture
def bucket(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Yield a store on an S3 server that only the environment knows."""
    server = ThreadedMotoServer(port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    monkeypatch.setenv("AWS_ACCESS_KEY_ID", "test")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "test")
    monkeypatch.setenv("AWS_DEFAULT_REGION", "us-east-1")
    monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://{host}:{port}")
    clients = fsspec.get_filesystem_class("s3")
    clients.clear_instance_cache()  # those of other tests know other servers
    yield "s3://records"
    clients.clear_instance_cache()
    server.stop()


@stage()
def noted(text: str) -> Artifact:
    return Store.from_environment().put("note.txt", text.encode())


@pytest.mark.medium
def test_records_are_kept_where_each_machine_finds_the_store(
    prefect_server: None, bucket: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One machine reaches the store by another address than the next: none is written down."""
    store = Store(bucket).create()
    monkeypatch.setenv("ROBOJACKSON_STORE", bucket)
    made = flow(lambda: noted("words"), name="noting")()
    assert noted.recorded("words") == made
    (record,) = store.list("records/noted")
    assert os.environ["AWS_ENDPOINT_URL"].encode() not in store.read(record)


@pytest.mark.medium
def test_deploying_registers_no_place_for_results(prefect_server: None, store_folder: Path) -> None:
    """A block of the server would know one machine's address, and a local store had none."""
    assert "results" not in asyncio.run(deployments._prepare())
