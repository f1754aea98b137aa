"""A wire that can be cut: forwards a port to another one, and for a time to no one."""

import socket
import threading
from contextlib import suppress

from tools.stack.service import free_port

CHUNK = 1 << 16
HOST = "127.0.0.1"


class Proxy:
    """Forwards `port` to `target` on this machine.

    Attributes:
        port: Port that it listens on.
        target: Port that it forwards to.
        intact: Whether it forwards now.
        refused: Connections that were requested while it was cut.
    """

    def __init__(self, target: int) -> None:
        self.port, self.target, self.intact = free_port(), target, True
        self.refused = 0
        self._open: set[socket.socket] = set()
        self._server = socket.create_server((HOST, self.port))
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self) -> None:
        """End all connections and refuse new ones."""
        self.intact = False
        for end in list(self._open):
            _close(end)

    def mend(self) -> None:
        """Forward data again."""
        self.intact = True

    def close(self) -> None:
        """Listen no more."""
        self.cut()
        _close(self._server)

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._server.accept()
            except OSError:
                return
            self._connect(near)

    def _connect(self, near: socket.socket) -> None:
        try:
            if not self.intact:
                self.refused += 1
                raise ConnectionRefusedError
            far = socket.create_connection((HOST, self.target), timeout=10)
        except OSError:
            _close(near)
            return
        far.settimeout(None)
        self._open |= {near, far}
        for pair in ((near, far), (far, near)):
            threading.Thread(target=self._pump, args=pair, daemon=True).start()

    def _pump(self, source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(CHUNK):
                sink.sendall(data)
        for end in (source, sink):
            self._open.discard(end)
            _close(end)


def _close(end: socket.socket) -> None:
    with suppress(OSError):
        end.shutdown(socket.SHUT_RDWR)
    with suppress(OSError):
        end.close()
