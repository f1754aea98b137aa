"""Set the environment that Prefect reads when it is imported.

Its home is inside the store, so that a run leaves nothing elsewhere; the temporary server gets the
time that it needs on two busy cores and sends no usage data. A run reports often enough that it
lives for the automation that marks dead ones (`configs/automations.yaml`).
"""

import os
from pathlib import Path

from storage.store import Store

HOME = "prefect"
ROOM_MB = 200
"""Free disk that a flow needs: its records, its server's database, the tables and the video."""
HEARTBEAT_S = 30
"""Between two heartbeats of a run; Prefect's own 180 s is longer than the silence that we allow."""
HEARTBEAT = {"PREFECT_FLOWS_HEARTBEAT_FREQUENCY": str(HEARTBEAT_S)}
FIXED = {
    **HEARTBEAT,
    "PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS": "120",
    "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
    "PREFECT_LOGGING_COLORS": "false",
    "DO_NOT_TRACK": "1",
}
BLOCKS = ("PREFECT_SERVER_REGISTER_BLOCKS_ON_START", "PREFECT_API_BLOCKS_REGISTER_ON_START")
"""Of the temporary server: no run uses blocks, and to register them takes a tenth of its start."""
LEASES = "PREFECT_SERVER_CONCURRENCY_LEASE_STORAGE"

SERVER = {
    # Relative to the page: right for every host name, port and proxy.
    ("PREFECT_UI_API_URL", "PREFECT_SERVER_UI_API_URL"): "/api",
    # The newer pages of Prefect 3.8 contact an analytics service with any settings.
    ("PREFECT_SERVER_UI_V2_ENABLED",): "false",
    ("PREFECT_SERVER_UI_SHOW_PROMOTIONAL_CONTENT",): "false",
    # In files of its home, who holds a slot of a deployment's limit. In its memory, the default, a
    # restart forgets it: Prefect then ends the nightly refresh that runs, and its slot stays taken.
    (LEASES,): "prefect.server.concurrency.lease_storage.filesystem",
}
"""Names of a variable of the server, and what it is where none of them is set."""


def prepare_server(store: Store) -> None:
    """Set what a server of ours needs and the user has not set, for this process.

    It reads the store and need not write it.

    Raises:
        StoreError: too little room on the disk of the database.
    """
    store.require_room(ROOM_MB)
    _set_home(store)
    for names, value in SERVER.items():
        if not any(name in os.environ for name in names):
            os.environ[names[0]] = value


def prepare(store: Store) -> None:
    """Set what the user has not set, for this process and its children.

    Raises:
        StoreError: too little room on the disk of the store; Prefect's server would hang on it.
    """
    store.require_writable(ROOM_MB)
    _set_home(store)
    if not any(name in os.environ for name in BLOCKS):
        os.environ[BLOCKS[0]] = "false"


def _set_home(store: Store) -> None:
    settings = {"PREFECT_HOME": str(store.here / HOME), **FIXED}
    for name, value in settings.items():
        os.environ.setdefault(name, value)
    # Without it the server's database cannot be opened.
    Path(os.environ["PREFECT_HOME"]).expanduser().mkdir(parents=True, exist_ok=True)
