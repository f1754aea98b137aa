"""A file that is replaced under its address is another video."""

import threading
from collections.abc import Iterator
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import ClassVar

import pytest

from robojackson.clips.web.file_version import SUFFIX, versioned
from robojackson.clips.web.video_candidate import GENERIC, VideoCandidate
from tests.fixtures.web_server import PATIENT


class Server(BaseHTTPRequestHandler):
    """A server that answers HEAD with these headers."""

    code: ClassVar[int] = 200
    facts: ClassVar[dict[str, str]] = {}
    requests: ClassVar[list[str]] = []

    def do_HEAD(self) -> None:
        self.requests.append(self.path)
        self.send_response(self.code)
        for name, value in self.facts.items():
            self.send_header(name, value)
        self.end_headers()

    def log_message(self, *args: object) -> None:
        """Log nothing."""


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[type[Server], str]]:
    """Yield the handler of a server and its address."""
    monkeypatch.setattr(Server, "requests", [])
    running = ThreadingHTTPServer(("127.0.0.1", 0), Server)
    threading.Thread(target=running.serve_forever, args=(0.02,), daemon=True).start()
    yield Server, f"http://127.0.0.1:{running.server_port}"
    running.shutdown()
    running.server_close()


def at(url: str) -> VideoCandidate:
    return VideoCandidate("clip-0123456789ab", url, "clip.mp4", "", GENERIC)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ({"ETag": '"a"'}, {"ETag": '"b"'}),
        ({"Last-Modified": "Tue, 01 Dec 2026"}, {"Last-Modified": "Wed, 02 Dec 2026"}),
        ({"Content-Length": "10"}, {"Content-Length": "11"}),
    ],
    ids=["ETag", "time", "length"],
)
def test_a_replaced_file_is_another_video(
    first: dict[str, str],
    second: dict[str, str],
    server: tuple[type[Server], str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    handler, address = server
    found = []
    for facts in (first, first, second):
        monkeypatch.setattr(handler, "facts", facts)
        found += versioned([at(f"{address}/clip.mp4?token=1")], PATIENT)
    assert found[0] == found[1] != found[2]
    assert all(SUFFIX.fullmatch(each.video_id.removeprefix("clip-0123456789ab")) for each in found)


def test_a_file_with_an_etag_is_the_same_whenever_it_is_asked_for(
    server: tuple[type[Server], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    handler, address = server
    found = []
    for time in ("Tue, 01 Dec 2026", "Wed, 02 Dec 2026"):
        monkeypatch.setattr(handler, "facts", {"ETag": '"a"', "Last-Modified": time})
        found += versioned([at(f"{address}/clip.mp4")], PATIENT)
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("code", "facts"),
    [(405, {"ETag": '"a"'}), (200, {}), (200, {"ETag": '"a"', "Content-Type": "text/html"})],
    ids=["no HEAD", "nothing", "a page"],
)
def test_a_server_that_reports_nothing_of_a_file_leaves_its_address(
    code: int,
    facts: dict[str, str],
    server: tuple[type[Server], str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    handler, address = server
    monkeypatch.setattr(handler, "code", code)
    monkeypatch.setattr(handler, "facts", facts)
    one = at(f"{address}/clip.mp4")
    assert versioned([one], PATIENT) == (one,)
    assert handler.requests == ["/clip.mp4"]


def test_pages_and_videos_of_sites_are_not_requested(server: tuple[type[Server], str]) -> None:
    handler, address = server
    others = (at(f"{address}/watch?v=clip.mp4"), replace(at(f"{address}/a.mp4"), source="youtube"))
    assert versioned(others, PATIENT) == others
    assert handler.requests == []


def test_a_private_address_is_not_requested_unless_that_is_allowed(
    server: tuple[type[Server], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    handler, address = server
    monkeypatch.setattr(handler, "facts", {"ETag": '"a"'})
    one = at(f"{address}/clip.mp4")
    assert versioned([one], replace(PATIENT, private_addresses=False)) == (one,)
    assert handler.requests == []
