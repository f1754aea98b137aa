"""What prefect.yaml deploys."""

import inspect
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import yaml
from prefect import Flow

ROOT = Path(__file__).parents[2]
DEPLOYMENTS = yaml.safe_load((ROOT / "prefect.yaml").read_text())["deployments"]


def flow_of(deployment: dict[str, Any]) -> Flow[Any, Any]:
    module, name = deployment["entrypoint"].rsplit(".", 1)
    found = getattr(import_module(module), name)
    assert isinstance(found, Flow)
    return found


@pytest.mark.parametrize("deployment", DEPLOYMENTS, ids=lambda d: d["name"])
def test_a_deployment_is_a_flow_with_the_parameters_it_gives(deployment: dict[str, Any]) -> None:
    known = inspect.signature(flow_of(deployment).fn).parameters
    assert set(deployment.get("parameters", {})) <= set(known)


def test_the_refresh_runs_every_night_and_by_hand() -> None:
    ours = {f"{flow_of(d).name}/{d['name']}": d.get("schedules", []) for d in DEPLOYMENTS}
    assert [schedule["cron"] for schedule in ours["refresh/nightly"]] == ["0 3 * * *"]
    assert ours["refresh/trending-now"] == []


def test_dances_can_be_named_from_outside() -> None:
    nightly = next(d for d in DEPLOYMENTS if d["name"] == "nightly")
    assert flow_of(nightly).validate_parameters({"dances": ["APT"]})["dances"] == ["APT"]
