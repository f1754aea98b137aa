"""What Prefect must find in the environment before it is imported.

Its home is inside the store, so that a run leaves nothing elsewhere; the temporary server gets the
time that it needs on two busy cores and tells nobody anything. A run says often enough that it
lives for the automation that marks dead ones (`configs/automations.yaml`).
"""

import os

from storage.store import Store

HOME = "prefect"
RECORDS = "records"
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


def prepare(store: Store) -> None:
    """Set what the user has not set, for this process and its children.

    Raises:
        StoreError: too little room on the disk of the store; Prefect's server would hang on it.
    """
    store.require_writable(ROOM_MB)
    home = store.here / HOME
    home.mkdir(parents=True, exist_ok=True)  # without it the server's database cannot be opened
    wanted = {
        "PREFECT_HOME": str(home),
        "PREFECT_LOCAL_STORAGE_PATH": str(home / RECORDS),
        **FIXED,
    }
    for name, value in wanted.items():
        os.environ.setdefault(name, value)
