"""Register pools, deployments and automations with a Prefect server.

Everything is registered by name and may be registered again: only what has changed is changed.
"""

import asyncio
import os
import subprocess
import sys
from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import yaml
from prefect.automations import Automation
from prefect.client.orchestration import PrefectClient, get_client
from prefect.client.schemas.actions import WorkPoolCreate, WorkPoolUpdate
from prefect.exceptions import ObjectNotFound
from prefect.settings import PREFECT_API_URL
from prefect.workers.process import ProcessWorker

from flows.runtime.environment import HEARTBEAT, HEARTBEAT_S
from flows.runtime.prefect_server import answering, await_server
from robojackson.errors import DeploymentFailed
from robojackson.pipeline.app_folder import app_folder
from robojackson.pipeline.configuration_files import find
from storage.store import Store

POOLS = {
    "flows": "Parents: refresh, dance, ablation. They wait more than they work.",
    "training": "Cells of an ablation and trainings: one at a time and core.",
}
"""Parents and cells apart: parents that wait would hold every slot of a common pool."""
SILENCE = "ROBOJACKSON_SILENCE_S"
"""Variable: seconds without a sign of life after which a run is marked Crashed."""
SILENT_S, SHORTEST_S = 150, 2 * HEARTBEAT_S + 1


def deploy(wait_s: float = 0.0) -> dict[str, Any]:
    """Register everything with the server of PREFECT_API_URL.

    Args:
        wait_s: How long a server that was just started may take to answer, seconds.
    Raises:
        DeploymentFailed: no server is named or answers, or it refuses something.
    """
    if not PREFECT_API_URL.value():
        raise DeploymentFailed(
            "PREFECT_API_URL names no server; start one (`robojackson server`) and set "
            "PREFECT_API_URL=http://127.0.0.1:4200/api"
        )
    await_server(wait_s)
    store = Store.from_environment().create()
    store.require_writable()
    with answering():
        made = asyncio.run(_prepare())
    return {**made, "deployments": _register()}


async def _prepare() -> dict[str, Any]:
    async with get_client() as client:
        for name, described in POOLS.items():
            await _pool(client, name, described)
    return {
        "pools": list(POOLS),
        "automations": [await _automation(facts) for facts in automations()],
    }


def automations() -> list[dict[str, Any]]:
    """Return the automations that are shipped, with the silence that the environment allows a run.

    Raises:
        DeploymentFailed: less than two signs of life would have to be missing.
    """
    target = os.environ.get(SILENCE, str(SILENT_S))
    if not target.isdecimal() or int(target) < SHORTEST_S:
        raise DeploymentFailed(
            f"{SILENCE}={target!r}: whole seconds, {SHORTEST_S} at least; runs report every "
            f"{HEARTBEAT_S} s that they live"
        )
    shipped = yaml.safe_load(find("automations").read_text())
    return [_with_silence(facts, int(target)) for facts in shipped]


def _with_silence(facts: dict[str, Any], silence_s: int) -> dict[str, Any]:
    """Return an automation as it would be written for another silence."""
    shipped = facts["trigger"]["within"]
    target = shipped * silence_s // SILENT_S
    facts["trigger"]["within"] = target
    for described, name in ((facts, "description"), (facts["actions"][0], "message")):
        described[name] = described[name].replace(f" {shipped} s", f" {target} s")
    return facts


async def _pool(client: PrefectClient, name: str, description: str) -> None:
    """Create a pool, or add the heartbeat of our runs to the existing one."""
    try:
        known = await client.read_work_pool(name)
    except ObjectNotFound:
        template = with_heartbeat(ProcessWorker.get_default_base_job_template())
        target = WorkPoolCreate(
            name=name, type="process", description=description, base_job_template=template
        )
        await client.create_work_pool(target)
        return
    template = with_heartbeat(known.base_job_template)
    if template != known.base_job_template:
        await client.update_work_pool(name, WorkPoolUpdate(base_job_template=template))


def with_heartbeat(template: Mapping[str, Any]) -> dict[str, Any]:
    """Return a job template whose runs get our heartbeat, in any environment of their worker."""
    made = deepcopy(dict(template))
    env = made["variables"]["properties"]["env"]
    env["default"] = {**env.get("default", {}), **HEARTBEAT}
    return made


async def _automation(facts: Mapping[str, Any]) -> str:
    target = Automation(**facts)
    try:
        known = await Automation.aread(name=target.name)
    except ValueError:
        await target.acreate()
    else:
        target.id = known.id
        await target.aupdate()
    return target.name


def _register() -> list[str]:
    """Register prefect.yaml by Prefect's own command, in the folder of the file."""
    command = [sys.executable, "-m", "prefect", "--no-prompt", "deploy", "--all"]
    run = subprocess.run(command, cwd=app_folder(), capture_output=True, text=True, check=False)
    if run.returncode:
        said = (run.stdout + run.stderr).strip().splitlines()
        raise DeploymentFailed(
            f"prefect deploy failed: {said[-1] if said else 'without a message'}"
        )
    entries = yaml.safe_load((app_folder() / "prefect.yaml").read_text())["deployments"]
    return [f"{entry['entrypoint'].rsplit('.', 1)[1]}/{entry['name']}" for entry in entries]
