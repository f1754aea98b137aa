"""`robojackson server`: Prefect's server with the settings that our runs need, and the results.

What the server shows links to files of the store (`RESULTS`), so that a page or a video opens
wherever the server does, with any host name. The browser calls the API relative to the page for
the same reason. Everything else is Prefect's: `PREFECT_` variables count as for its own command.
"""

import errno
import mimetypes
import os
import secrets
import shutil
import socket
import tempfile
from base64 import b64encode
from pathlib import Path, PurePosixPath

import uvicorn
from prefect.server.api.server import create_app
from prefect.settings import get_current_settings
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.types import ASGIApp

from flows.runtime.run_artifacts import OPEN_FOLDERS, RESULTS
from flows.runtime.sqlite_writers import queued_writers
from robojackson.errors import DeploymentFailed, StoreError
from robojackson.files.local_folder import LocalFolder
from storage.store import Store

ISOLATED = {
    "Content-Security-Policy": "sandbox allow-scripts allow-downloads allow-popups",
    "X-Content-Type-Options": "nosniff",
}
"""A page of results is its own origin: it cannot read what the browser keeps for Prefect."""
CHALLENGE = {"WWW-Authenticate": 'Basic realm="RoboJackson"'}
PORT_REFUSED = (errno.EADDRINUSE, errno.EACCES)
"""What the system answers where another port would do."""
UNKNOWN_TYPE = "application/octet-stream"


def serve(store: Store, host: str, port: int) -> None:
    """Run the server until it gets a signal to end.

    Args:
        store: The store whose results it shows.
        host, port: Where it listens.
    Raises:
        DeploymentFailed: it cannot listen there.
    """
    _require_free(host, port)
    app = create_app(final=True)
    app.router.routes.insert(0, Mount(RESULTS, app=results(store)))  # the UI after it takes all
    server = get_current_settings().server
    with queued_writers():
        uvicorn.run(
            app,
            host=host,
            port=port,
            timeout_keep_alive=server.api.keepalive_timeout,
            log_level=server.logging_level.lower(),
        )


def netloc(host: str, port: int) -> str:
    """Return a host and a port as they stand in an address: an IPv6 host in brackets."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def _require_free(host: str, port: int) -> None:
    """Listen for a moment on every address that uvicorn will listen on."""
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        for family, address in dict.fromkeys((each[0], each[4]) for each in found):
            socket.create_server(address, family=family).close()
    except OSError as cause:
        is_name = isinstance(cause, socket.gaierror)
        reason = cause.strerror if is_name else os.strerror(cause.errno or 0)
        advice = "choose another --port, or end what listens there"
        if is_name or cause.errno not in PORT_REFUSED:
            advice = "--host is an address of this machine, such as 127.0.0.1 or ::1"
        raise DeploymentFailed(
            f"cannot listen on {netloc(host, port)}: {reason}; {advice}"
        ) from cause


def results(store: Store) -> ASGIApp:
    """Return the web application that hands out the pages, videos and tables of a store.

    It requires the password of the server, if that has one.
    """

    async def answer(request: Request) -> Response:
        if not _is_allowed(request):
            return PlainTextResponse("the password of the server", 401, CHALLENGE)
        key = _key(request.path_params["path"])
        if key is None:
            return _missing()
        try:
            return await run_in_threadpool(_file, store, key)
        except StoreError:
            return _missing()

    return Route("/{path:path}", answer, methods=["GET", "HEAD"])


def _is_allowed(request: Request) -> bool:
    password = get_current_settings().server.api.auth_string
    if password is None:
        return True
    expected = b"Basic " + b64encode(password.get_secret_value().encode())
    return secrets.compare_digest(request.headers.get("Authorization", "").encode(), expected)


def _key(path: str) -> str | None:
    """Return the key of the store that a path of the web names; None where it names none."""
    parts = PurePosixPath(path).parts
    if len(parts) < 2 or parts[0] not in OPEN_FOLDERS or {"..", "."} & set(parts) or "\0" in path:
        return None
    return "/".join(parts)


def _file(store: Store, key: str) -> Response:
    """Return a file, whole or the part that the browser requests.

    Raises:
        StoreError: the store has no such file.
    """
    kind = mimetypes.guess_type(key)[0] or UNKNOWN_TYPE
    if isinstance(store.place, LocalFolder):
        path = (store.place.root / key).resolve()
        if not path.is_file() or not path.is_relative_to(store.place.root.resolve()):
            return _missing()
        return FileResponse(path, media_type=kind, headers=ISOLATED)
    folder = Path(tempfile.mkdtemp(prefix="robojackson-"))
    remove = BackgroundTask(shutil.rmtree, folder, ignore_errors=True)
    try:
        copy = folder / "file"
        copy.write_bytes(store.read(key))
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return FileResponse(copy, media_type=kind, headers=ISOLATED, background=remove)


def _missing() -> Response:
    return PlainTextResponse("no such result", 404)
