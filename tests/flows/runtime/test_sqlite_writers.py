"""Transactions of Prefect's server that read before they write do not fail for others."""

import asyncio
from pathlib import Path
from socket import socket

import pytest
import sqlalchemy as sa
from prefect.server.database.configurations import AioSqliteConfiguration
from prefect.settings import PREFECT_API_DATABASE_CONNECTION_URL, temporary_settings
from sqlalchemy.exc import OperationalError

from flows.runtime import server_process
from flows.runtime.sqlite_writers import QueuedSqlite, queued_writers

WRITERS, ROUNDS = 8, 5
COUNT = "SELECT count FROM counter"


async def counted(config: AioSqliteConfiguration) -> int:
    """Let writers count together: each reads, gives way to the others, and writes."""
    engine = await config.engine()
    async with engine.begin() as connection:
        await connection.execute(sa.text("CREATE TABLE counter (count INTEGER)"))
        await connection.execute(sa.text("INSERT INTO counter VALUES (0)"))

    async def count() -> None:
        for _ in range(ROUNDS):
            session = await config.session(engine)
            async with session, config.begin_transaction(session):
                read = (await session.execute(sa.text(COUNT))).scalar_one()
                await asyncio.sleep(0.01)
                await session.execute(sa.text("UPDATE counter SET count = :n"), {"n": read + 1})

    await asyncio.gather(*(count() for _ in range(WRITERS)))
    session = await config.session(engine)
    async with session:
        found = int((await session.execute(sa.text(COUNT))).scalar_one())
    await engine.dispose()
    return found


@pytest.mark.medium
def test_readers_that_become_writers_wait_for_each_other(tmp_path: Path) -> None:
    config = QueuedSqlite(connection_url=f"sqlite+aiosqlite:///{tmp_path}/prefect.db")
    assert asyncio.run(counted(config)) == WRITERS * ROUNDS


def test_as_prefect_begins_them_they_fail(tmp_path: Path) -> None:
    """If this passes no more, Prefect has mended it and `flows.runtime.sqlite_writers` can go."""
    config = AioSqliteConfiguration(connection_url=f"sqlite+aiosqlite:///{tmp_path}/prefect.db")
    with pytest.raises(OperationalError, match="database is locked"):
        asyncio.run(counted(config))


@pytest.mark.parametrize(
    ("address", "queued"),
    [
        ("sqlite+aiosqlite:////tmp/prefect.db", True),
        ("postgresql+asyncpg://user:pw@localhost/prefect", False),
    ],
)
def test_only_sqlite_is_queued(address: str, queued: bool) -> None:
    from prefect.server.database import dependencies

    with temporary_settings({PREFECT_API_DATABASE_CONNECTION_URL: address}), queued_writers():
        config = dependencies.MODELS_DEPENDENCIES["database_config"]
    assert isinstance(config, QueuedSqlite) == queued


def test_the_temporary_server_queues_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """After a `deploy` on the same store its automations write, too."""
    from prefect.server.database import dependencies

    found: list[object] = []

    def run(server: object, sockets: list[socket]) -> None:
        found.append(dependencies.MODELS_DEPENDENCIES["database_config"])

    monkeypatch.setattr("uvicorn.Server.run", run)
    address = "sqlite+aiosqlite:////tmp/prefect.db"
    with socket() as listening, temporary_settings({PREFECT_API_DATABASE_CONNECTION_URL: address}):
        server_process.serve(listening.detach(), pipe=-1)
    assert isinstance(found[0], QueuedSqlite)
