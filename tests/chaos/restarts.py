"""`restart: unless-stopped` for the services of a stack: what ends is started again."""

import threading
import time

from tools.stack.compose_stack import Stack

SECONDS_DOWN = 3.0


class Restarts:
    """Starts services that have ended, from a thread, until it has to stop.

    Attributes:
        count: How often one was started again, by name.
    """

    def __init__(self, stack: Stack) -> None:
        self.count: dict[str, int] = {}
        staying = {n for n, s in stack.file.items() if s.get("restart") == "unless-stopped"}
        self._services = [s for s in stack.services.values() if _plain(s.name) in staying]
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Start nothing any more."""
        self._end.set()
        self._thread.join()

    def _watch(self) -> None:
        ended: dict[str, float] = {}
        while not self._end.wait(0.5):
            for service in self._services:
                assert service.process is not None
                if service.process.poll() is None:
                    continue
                since = ended.setdefault(service.name, time.monotonic())
                if time.monotonic() - since > SECONDS_DOWN:
                    del ended[service.name]
                    self.count[service.name] = self.count.get(service.name, 0) + 1
                    service.start()


def _plain(name: str) -> str:
    """Return the service's name without the number of a second one."""
    head, _, tail = name.rpartition("-")
    return head if tail.isdigit() else name
