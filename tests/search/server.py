"""A server of our own that serves videos, pages and every way to fail."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import ClassVar

from robojackson.clips.web import WebConfig

STALL_S = 3.0
PATIENT = WebConfig(
    retries=2, backoff_s=0.01, timeout_s=1.0, request_pause_s=0.0, rate_limit_bytes_s=None
)


@dataclass
class Web:
    """The server as the tests see it.

    Attributes:
        url: Its address.
        video: The bytes of its video.
        asked: Every request: path and Range header.
    """

    url: str
    video: bytes
    asked: list[tuple[str, str | None]] = field(default_factory=list)

    def times(self, path: str) -> int:
        """How often a path was asked for."""
        return sum(1 for asked, _ in self.asked if asked == path)


class Handler(BaseHTTPRequestHandler):
    """One page a kind of answer; the path's first part says which."""

    web: ClassVar[Web]
    protocol_version = "HTTP/1.1"

    def do_HEAD(self) -> None:
        self.do_GET()

    def do_GET(self) -> None:
        path = self.path.split("?")[0]
        self.web.asked.append((path, self.headers.get("Range")))
        kind = path.strip("/").split("/")[0]
        getattr(self, f"_{kind.split('.')[0].replace('-', '_')}", self._missing)()

    def _good(self) -> None:
        self._range(self.web.video)

    def _missing(self) -> None:
        self._say(404, b"no such page", "text/plain")

    def _busy(self) -> None:
        self._say(429, b"slow down", "text/plain", {"Retry-After": "0"})

    def _busy_once(self) -> None:
        if self.web.times(self.path) == 1:
            self._busy()
        else:
            self._good()

    def _broken(self) -> None:
        self._say(503, b"out of order", "text/plain")

    def _stall(self) -> None:
        self._head(200, len(self.web.video), "video/mp4")
        time.sleep(STALL_S)
        self.close_connection = True

    def _half(self) -> None:
        """Half a file, whoever asks and from where."""
        self._cut(self.web.video, once=False)

    def _half_once(self) -> None:
        """Half a file at first, then what is asked for."""
        self._cut(self.web.video, once=True)

    def _wrong_length(self) -> None:
        """A length that is shorter than the file, so that its end never comes."""
        part = self.web.video[: len(self.web.video) // 3]
        self._say(200, part, "video/mp4")

    def _moved(self) -> None:
        self._say(302, b"", "text/plain", {"Location": "/good/clip.mp4"})

    def _circle(self) -> None:
        self._say(302, b"", "text/plain", {"Location": self.path})

    def _text(self) -> None:
        self._say(200, b"this is no video at all, " * 40, "video/mp4")

    def _endless(self) -> None:
        self._head(200, 10**9, "video/mp4")
        self.close_connection = True

    def _search(self) -> None:
        """A search page: a feed of videos, as many a site has."""
        items = "".join(
            f"<item><title>{title}</title><link>{self.web.url}/{path}</link></item>"
            for title, path in (
                ("The good one", "good/clip.mp4"),
                ("Gone", "missing/clip.mp4"),
                ("A long way &amp; round", "moved/clip.mp4"),
            )
        )
        feed = f'<?xml version="1.0"?><rss version="2.0"><channel><title>s</title>{items}'
        self._say(200, f"{feed}</channel></rss>".encode(), "application/rss+xml")

    def _files(self) -> None:
        links = (
            "../good/clip.mp4",
            "/half/clip.webm",
            "notes.txt",
            "http://elsewhere/x.mp4",
            "../",
        )
        page = "".join(f'<li><a href="{link}">{link}</a></li>' for link in links)
        self._say(200, f"<html><body><ul>{page}</ul></body></html>".encode(), "text/html")

    def _range(self, data: bytes) -> None:
        asked = self.headers.get("Range")
        if not asked:
            self._say(200, data, "video/mp4", {"Accept-Ranges": "bytes"})
            return
        start = int(asked.removeprefix("bytes=").split("-")[0])
        told = {"Content-Range": f"bytes {start}-{len(data) - 1}/{len(data)}"}
        self._say(206, data[start:], "video/mp4", told)

    def _cut(self, data: bytes, once: bool) -> None:
        asked = self.headers.get("Range")
        is_whole = asked is None or not once
        if not is_whole:
            self._range(data)
            return
        self._head(200, len(data), "video/mp4")
        self._body(data[: len(data) // 2])
        self.close_connection = True

    def _say(self, status: int, body: bytes, kind: str, more: dict[str, str] | None = None) -> None:
        self._head(status, len(body), kind, more)
        self._body(body)

    def _head(
        self, status: int, length: int, kind: str, more: dict[str, str] | None = None
    ) -> None:
        self.send_response(status)
        for name, value in {"Content-Type": kind, **(more or {})}.items():
            self.send_header(name, value)
        self.send_header("Content-Length", str(length))
        self.end_headers()

    def _body(self, body: bytes) -> None:
        if self.command == "HEAD":
            return
        try:
            self.wfile.write(body)
        except (BrokenPipeError, ConnectionResetError):
            self.close_connection = True

    def log_message(self, *args: object) -> None:
        """Quiet."""


class _Server(ThreadingHTTPServer):
    """A server whose clients may hang up."""

    def handle_error(self, request: object, client_address: object) -> None:
        """Quiet."""


@contextmanager
def serving(video: bytes) -> Iterator[Web]:
    """A running server with one video."""
    handler = type("Bound", (Handler,), {})
    server = _Server(("127.0.0.1", 0), handler)
    server.daemon_threads = True
    handler.web = Web(f"http://127.0.0.1:{server.server_port}", video)  # type: ignore[attr-defined]
    threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
    try:
        yield handler.web  # type: ignore[attr-defined]
    finally:
        server.shutdown()
        server.server_close()
