"""docker-compose.yml follows its specification, needs passwords, and keeps what it should."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from tools.service import StackError, interpolate
from tools.stack import COMPOSE, PASSWORDS, passwords

ROOT = Path(__file__).parents[2]
FILE: dict[str, Any] = yaml.safe_load(COMPOSE.read_text())
SERVICES: dict[str, Any] = FILE["services"]
SECRETS = (*PASSWORDS, "PREFECT_AUTH")


def test_it_follows_the_compose_specification() -> None:
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.compose-spec"]
    run = subprocess.run([*command, str(COMPOSE)], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout


@pytest.mark.parametrize("missing", SECRETS)
def test_without_a_password_nothing_starts(missing: str) -> None:
    given = {name: value for name, value in passwords().items() if name != missing}
    with pytest.raises(StackError, match=f"{missing} is missing a value: set {missing}"):
        interpolate(SERVICES, given)


def test_the_example_names_every_variable_and_gives_no_password() -> None:
    lines = (ROOT / ".env.example").read_text().splitlines()
    example = dict(line.split("=", 1) for line in lines if re.match(r"\w+=", line))
    wanted = set(re.findall(r"\$\{(\w+)", COMPOSE.read_text()))
    assert set(example) == wanted
    assert [example[name] for name in SECRETS] == ["", "", ""]


def test_every_image_has_a_tag_that_does_not_move() -> None:
    tags = [service["image"].partition(":")[2] for service in SERVICES.values()]
    assert all(re.search(r"\d", tag) for tag in tags)


def test_every_service_that_stays_has_a_health_check() -> None:
    staying = {n for n, s in SERVICES.items() if s.get("restart") == "unless-stopped"}
    assert staying == {n for n, s in SERVICES.items() if "healthcheck" in s}


def test_data_is_in_named_volumes() -> None:
    used = {v.split(":")[0] for s in SERVICES.values() for v in s.get("volumes", [])}
    assert used == set(FILE["volumes"])


def ports(**given: str) -> dict[str, list[str]]:
    """Where each service listens for others than services."""
    made = interpolate(SERVICES, {**passwords(), **given})
    return {name: service["ports"] for name, service in made.items() if "ports" in service}


def test_nothing_listens_to_the_world_by_itself() -> None:
    assert ports() == {"prefect-server": ["127.0.0.1:4200:4200"], "s3": ["127.0.0.1:9000:9000"]}


def test_other_machines_are_let_in_by_one_address() -> None:
    told = {"prefect-server": ["10.0.0.5:4200:4200"], "s3": ["10.0.0.5:9000:9000"]}
    assert ports(BIND="10.0.0.5") == told


@pytest.mark.parametrize(
    ("name", "at_home", "elsewhere"),
    [
        ("PREFECT_API_URL", "http://prefect-server:4200/api", "http://10.0.0.5:4200/api"),
        ("AWS_ENDPOINT_URL", "http://s3:9000", "http://10.0.0.5:9000"),
    ],
)
@pytest.mark.parametrize("worker", ["flow-worker", "trainer"])
def test_a_worker_of_another_machine_is_told_where_the_first_one_is(
    worker: str, name: str, at_home: str, elsewhere: str
) -> None:
    for given, expected in (({}, at_home), ({name: elsewhere}, elsewhere)):
        made = interpolate(SERVICES, {**passwords(), **given})
        assert made[worker]["environment"][name] == expected


def test_the_server_asks_who_it_is_and_tells_nobody() -> None:
    environment = SERVICES["prefect-server"]["environment"]
    assert environment["PREFECT_SERVER_API_AUTH_STRING"].startswith("${PREFECT_AUTH:?")
    assert environment["PREFECT_SERVER_ANALYTICS_ENABLED"] == "false"
    assert environment["DO_NOT_TRACK"] == "1"


def test_parents_and_trainings_have_workers_of_their_own() -> None:
    pools = {n: s["command"][4] for n, s in SERVICES.items() if "worker" in s.get("command", [])}
    assert pools == {"flow-worker": "flows", "trainer": "training"}


def test_the_image_runs_as_a_user_without_rights() -> None:
    words = [line.split() for line in (ROOT / "Dockerfile").read_text().splitlines() if line]
    users = [line[1] for line in words if line[0] == "USER"]
    assert users[-1] not in ("root", "0")
