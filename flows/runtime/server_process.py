"""The process of a temporary Prefect server: `python -P server_process.py SOCKET PIPE`."""

import logging
import os
import sys
from socket import socket

import uvicorn
from prefect.server.api.server import create_app

from flows.runtime.sqlite_writers import queued_writers

CONTINUED = (" ", "(")
"""What lines of a traceback begin with that do not name the exception."""


def serve(descriptor: int, pipe: int) -> None:
    """Answer on a socket that listens already, until SIGTERM or SIGINT.

    Args:
        descriptor: Of the socket.
        pipe: Where to write, in one line, why the server does not start; nothing where it does.
    """
    server = uvicorn.Server(
        uvicorn.Config(create_app(ephemeral=True, final=True), log_level="error")
    )

    def is_shown(record: logging.LogRecord) -> bool:
        """Return whether to log a record; those before the start go into the pipe."""
        if not server.started:
            os.write(pipe, reason(record.getMessage()).encode())
        return server.started

    logging.getLogger("uvicorn.error").addFilter(is_shown)
    with queued_writers():
        server.run(sockets=[socket(fileno=descriptor)])


def reason(text: str) -> str:
    """Return the line of a traceback that names the exception; nothing of any other text."""
    if not text.startswith("Traceback"):
        return ""
    return [line for line in text.splitlines() if line and not line.startswith(CONTINUED)][-1]


if __name__ == "__main__":
    serve(*map(int, sys.argv[1:]))
