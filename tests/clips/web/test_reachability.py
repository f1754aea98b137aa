"""One attempt to reach a site: quick where there is no network, and the line says what to do."""

import socket
import time

import pytest

from robojackson.clips.sources import page_of
from robojackson.clips.web.reachability import require_reachable
from robojackson.clips.web.yt_dlp_client import WebConfig, listing
from robojackson.errors import SearchFailed
from tests.fixtures.web_server import PATIENT, Web

CLOSED_PORT = "http://127.0.0.1:9"


@pytest.fixture
def unresolved(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take the name server away."""

    def fail(*_: object, **__: object) -> None:
        raise socket.gaierror(-2, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", fail)
    for name in ("http_proxy", "https_proxy", "all_proxy"):
        monkeypatch.delenv(name, raising=False)
        monkeypatch.delenv(name.upper(), raising=False)


def test_a_site_that_answers_is_reachable(web: Web) -> None:
    require_reachable(f"{web.url}/listing")


def test_a_refused_connection_names_the_host_and_what_to_do() -> None:
    result = r"no connection to 127.0.0.1 .*refused.*--source folder"
    with pytest.raises(SearchFailed, match=result):
        require_reachable(CLOSED_PORT)


def test_a_name_that_cannot_be_resolved_is_one_line(unresolved: None) -> None:
    result = r"www\.youtube\.com \(Name or service not known\)"
    with pytest.raises(SearchFailed, match=result) as caught:
        require_reachable("https://www.youtube.com")
    assert "\n" not in str(caught.value)


def test_a_name_server_that_is_silent_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: time.sleep(2) or [])
    began = time.monotonic()
    with pytest.raises(SearchFailed, match=r"no answer in 0\.1 s"):
        require_reachable("https://www.youtube.com", patience_s=0.1)
    assert time.monotonic() - began < 1


@pytest.mark.parametrize("by_environment", [True, False])
def test_behind_a_proxy_only_the_proxy_has_to_answer(
    web: Web, by_environment: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if by_environment:
        monkeypatch.setenv("https_proxy", web.url)
    require_reachable("https://nowhere.invalid", None if by_environment else web.url)


@pytest.mark.parametrize("proxy", ["http://x:auto", "http://me:se/cret@x:80"])
def test_a_proxy_that_is_no_address_is_one_line(proxy: str) -> None:
    with pytest.raises(SearchFailed, match=r"no connection to host through the proxy") as failed:
        require_reachable("https://host/", proxy)
    assert "cret" not in str(failed.value) or "me" not in str(failed.value)


def test_a_proxy_that_does_not_answer_is_named() -> None:
    with pytest.raises(SearchFailed, match=r"nowhere\.invalid through the proxy 127\.0\.0\.1"):
        require_reachable("https://nowhere.invalid", CLOSED_PORT)


@pytest.mark.parametrize(
    ("source", "address", "page"),
    [
        ("youtube", "", "https://www.youtube.com"),
        ("youtube", "ytsearchdate", "https://www.youtube.com"),
        ("youtube", "scsearch", ""),
        ("site", "https://host/s?q={query}", "https://host/s?q=%7Bquery%7D"),
        ("server", "http://host/", "http://host/"),
        ("folder", "/clips", ""),
        ("urls", "list.txt", ""),
    ],
)
def test_a_source_names_the_page_that_it_reads(source: str, address: str, page: str) -> None:
    assert page_of(source, "apt", address) == page


@pytest.mark.medium
def test_a_name_that_cannot_be_resolved_is_requested_twice_at_most(unresolved: None) -> None:
    patient = WebConfig(retries=4, backoff_s=0.01, request_pause_s=0.0, private_addresses=True)
    with pytest.raises(SearchFailed, match=r"no connection \(Failed to resolve .*\(2 attempts\)"):
        listing("http://nowhere.invalid/clip.mp4", patient)


def test_a_refused_connection_may_come_right_later() -> None:
    with pytest.raises(SearchFailed, match=r"\(3 attempts\)"):
        listing(f"{CLOSED_PORT}/clip.mp4", PATIENT)
