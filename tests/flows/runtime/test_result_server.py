"""The server hands out the results of the store, and nothing else of it."""

import os
import subprocess
import sys
from pathlib import Path
from socket import AddressFamily, create_server

import pytest
from prefect.settings import PREFECT_SERVER_API_AUTH_STRING, temporary_settings

from flows.runtime import environment
from flows.runtime.result_server import results, serve
from robojackson.errors import DeploymentFailed
from storage.store import Store
from tests.fixtures.commands import robojackson
from tests.flows.runtime.browser import Web

FILM = bytes(range(200))
FOLDER = "dances/hips-0123"


def filled(root: str) -> Store:
    store = Store(root).create()
    for key in (f"{FOLDER}/index.html", "prefect/prefect.db", "records/train/a.json", "secret.txt"):
        store.put(key, b"<p>")
    store.put(f"{FOLDER}/dance.mp4", FILM)
    return store


@pytest.fixture(params=["folder", "memory://serving"])
def web(request: pytest.FixtureRequest, tmp_path: Path) -> Web:
    root = str(tmp_path / "store") if request.param == "folder" else request.param
    return Web(results(filled(root)))


def test_a_page_is_handed_out_in_an_origin_of_its_own(web: Web) -> None:
    page = web.get(f"/{FOLDER}/index.html")
    assert (page.status_code, page.content) == (200, b"<p>")
    assert page.headers["content-type"].startswith("text/html")
    assert page.headers["content-security-policy"].startswith("sandbox ")
    assert "allow-same-origin" not in page.headers["content-security-policy"]


def test_a_part_of_a_video_is_handed_out(web: Web) -> None:
    part = web.get(f"/{FOLDER}/dance.mp4", headers={"Range": "bytes=10-19"})
    assert (part.status_code, part.content) == (206, FILM[10:20])


@pytest.mark.parametrize(
    "path",
    [
        "/prefect/prefect.db",
        "/records/train/a.json",
        "/secret.txt",
        "/dances",
        "/dances/",
        f"/{FOLDER}",
        f"/{FOLDER}/gone.mp4",
        "/dances/../secret.txt",
        "/dances/%2e%2e/secret.txt",
        "/dances/..%2fsecret.txt",
        "//etc/passwd",
        "/dances//etc/passwd",
        "/dances/a%00b",
    ],
)
def test_nothing_else_is_handed_out(web: Web, path: str) -> None:
    assert web.get(path).status_code == 404


def test_a_link_that_leads_out_of_the_store_is_not_followed(tmp_path: Path) -> None:
    store = filled(str(tmp_path / "store"))
    (tmp_path / "outside.txt").write_text("secret")
    (tmp_path / "store" / FOLDER / "link.txt").symlink_to(tmp_path / "outside.txt")
    assert Web(results(store)).get(f"/{FOLDER}/link.txt").status_code == 404


def test_nothing_can_be_written(web: Web) -> None:
    assert web.request("PUT", f"/{FOLDER}/index.html", content=b"x").status_code == 405


@pytest.mark.parametrize(
    ("given", "code"), [(None, 401), (("user", "wrong"), 401), (("user", "right"), 200)]
)
def test_a_server_with_a_password_asks_for_it(
    web: Web, given: tuple[str, str] | None, code: int
) -> None:
    with temporary_settings({PREFECT_SERVER_API_AUTH_STRING: "user:right"}):
        answer = web.get(f"/{FOLDER}/index.html", auth=given)
    assert answer.status_code == code
    assert ("www-authenticate" in answer.headers) == (code == 401)


@pytest.mark.medium
def test_a_port_that_is_taken_is_one_line(tmp_path: Path) -> None:
    with create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        message_text = robojackson(
            "server", "--port", port, ROBOJACKSON_STORE=str(tmp_path / "store")
        )
    assert message_text.code == 1
    assert (
        f"DeploymentFailed: cannot listen on 127.0.0.1:{port}: Address already" in message_text.err
    )
    assert "Traceback" not in message_text.err


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int]]:
    """Where uvicorn would listen."""
    places: list[tuple[str, int]] = []
    monkeypatch.setattr(
        "flows.runtime.result_server.uvicorn.run",
        lambda app, host, port, **more: places.append((host, port)),
    )
    return places


def free_port(host: str, family: AddressFamily) -> int:
    with create_server((host, 0), family=family) as found:
        port: int = found.getsockname()[1]
    return port


def ipv6() -> bool:
    """Whether this machine has the address ::1."""
    try:
        return free_port("::1", AddressFamily.AF_INET6) > 0
    except OSError:
        return False


def test_a_host_of_ipv6_is_listened_on(tmp_path: Path, served: list[tuple[str, int]]) -> None:
    if not ipv6():
        with pytest.raises(DeploymentFailed, match="--host is an address of this machine"):
            serve(filled(str(tmp_path)), "::1", 4321)
        return
    port = free_port("::1", AddressFamily.AF_INET6)
    serve(filled(str(tmp_path)), "::1", port)
    assert served == [("::1", port)]
    with (
        create_server(("::1", port), family=AddressFamily.AF_INET6),
        pytest.raises(
            DeploymentFailed, match=rf"on \[::1\]:{port}: Address already in use; choose"
        ),
    ):
        serve(filled(str(tmp_path)), "::1", port)


@pytest.mark.parametrize("host", ["192.0.2.1", "no-host.invalid", "[::1]"])
def test_a_host_that_is_not_of_this_machine_is_refused_as_such(
    host: str, tmp_path: Path, served: list[tuple[str, int]]
) -> None:
    with pytest.raises(DeploymentFailed, match="; --host is an address of this machine"):
        serve(filled(str(tmp_path)), host, 4321)
    assert served == []


PRINTED = """
import os
from flows.runtime.environment import prepare_server
from storage.store import Store
prepare_server(Store.from_environment())
from prefect.settings import PREFECT_UI_API_URL
print(PREFECT_UI_API_URL.value())
"""


@pytest.mark.medium
@pytest.mark.parametrize("given", ["PREFECT_UI_API_URL", "PREFECT_SERVER_UI_API_URL", None])
def test_the_pages_call_the_server_relative_to_themselves_unless_the_user_says_else(
    given: str | None, tmp_path: Path
) -> None:
    known = {name for names in environment.SERVER for name in names}
    inherited = {k: v for k, v in os.environ.items() if k not in known}
    more = {"ROBOJACKSON_STORE": str(tmp_path / "store"), "PREFECT_HOME": str(tmp_path / "home")}
    more |= {given: "http://proxy/api"} if given else {}
    command = [sys.executable, "-c", PRINTED]
    run = subprocess.run(
        command, env=inherited | more, capture_output=True, text=True, check=True, timeout=120
    )
    assert run.stdout.strip() == ("http://proxy/api" if given else "/api")


def test_a_server_need_not_write_the_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its role in the object store may only read."""
    monkeypatch.setenv("PREFECT_HOME", str(tmp_path / "home"))
    for name in {name for names in environment.SERVER for name in names}:
        monkeypatch.setenv(name, "given")
    environment.prepare_server(Store(tmp_path / "store"))
    assert not (tmp_path / "store").exists()
