"""A run that holds a slot of a deployment's limit still holds it when the server has restarted."""

import asyncio
import os
from datetime import timedelta
from pathlib import Path
from uuid import uuid4

import pytest
from prefect.server.concurrency.lease_storage import (
    ConcurrencyLimitLeaseMetadata,
    get_concurrency_lease_storage,
)
from prefect.settings import (
    PREFECT_HOME,
    PREFECT_SERVER_CONCURRENCY_LEASE_STORAGE,
    temporary_settings,
)

from flows.runtime.environment import FIXED, LEASES, SERVER, prepare_server
from storage.store import Store

MINUTES = timedelta(minutes=5)


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Let an environment be prepared that goes away with the test."""
    monkeypatch.setattr(os, "environ", dict(os.environ))
    for name in (*FIXED, *(name for names in SERVER for name in names), "PREFECT_HOME"):
        os.environ.pop(name, None)
    return monkeypatch


def test_our_server_keeps_leases_in_files_of_its_home(
    bare: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Prefect's own default is the memory of the server, with which they end."""
    prepare_server(Store(tmp_path))
    chosen = {
        PREFECT_SERVER_CONCURRENCY_LEASE_STORAGE: os.environ[LEASES],
        PREFECT_HOME: Path(os.environ["PREFECT_HOME"]),
    }

    async def renewed_after_a_restart() -> bool | None:
        facts = ConcurrencyLimitLeaseMetadata(slots=1)
        lease = await get_concurrency_lease_storage().create_lease([uuid4()], MINUTES, facts)
        return await get_concurrency_lease_storage().renew_lease(lease.id, MINUTES)

    with temporary_settings(chosen):
        assert asyncio.run(renewed_after_a_restart()) is True
    assert list((tmp_path / "prefect" / "concurrency_leases").glob("*.json"))


def test_a_user_may_keep_them_elsewhere(bare: pytest.MonkeyPatch, tmp_path: Path) -> None:
    os.environ[LEASES] = "mine"
    prepare_server(Store(tmp_path))
    assert os.environ[LEASES] == "mine"
