"""What prefect.yaml deploys."""

import inspect
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import yaml
from prefect import Flow

from flows.deploy import SILENCE, automations
from robojackson.errors import DeploymentFailed

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


def test_dances_are_asked_for_by_name() -> None:
    wanted = next(d for d in DEPLOYMENTS if d["entrypoint"] == "flows.dance.dance")
    assert flow_of(wanted).validate_parameters({"source": "APT"})["source"] == "APT"


def within(**silence: str) -> dict[str, int]:
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv(SILENCE, raising=False)
        for name, value in silence.items():
            patch.setenv(name, value)
        return {facts["name"]: facts["trigger"]["within"] for facts in automations()}


def test_the_silence_of_a_run_can_be_chosen() -> None:
    shipped, quick = within(), within(**{SILENCE: "75"})
    assert quick == {name: seconds / 2 for name, seconds in shipped.items()}


def test_an_automation_tells_its_seconds() -> None:
    told = {f["trigger"]["within"]: f["actions"][0]["message"] for f in automations()}
    assert all(f" {seconds} s" in message for seconds, message in told.items())


@pytest.mark.parametrize("seconds", ["60", "-1", "soon"])
def test_a_silence_shorter_than_two_signs_of_life_is_refused(seconds: str) -> None:
    with pytest.raises(DeploymentFailed, match=f"{SILENCE}='{seconds}': whole seconds, 61 at"):
        within(**{SILENCE: seconds})
