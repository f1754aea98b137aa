"""The current stage of a pass, for listeners."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Listener = Callable[[str], None]
_listeners: list[Listener] = []


def announce(stage: str) -> None:
    """Notify all listeners of this process that a stage begins."""
    for listener in _listeners:
        listener(stage)


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Call a function with the name of every stage that begins inside."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)
