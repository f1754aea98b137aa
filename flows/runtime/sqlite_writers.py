"""Prefect's SQLite without "database is locked".

Prefect begins its transactions as readers. One that reads and then writes, as triggers and states
of runs do, fails at once when another has written meanwhile: SQLite cannot let it wait, as what it
has read is no longer true. Begun as a writer it waits for its turn (`PRAGMA busy_timeout`, 60 s).
"""

from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager

from prefect.server.database.configurations import AioSqliteConfiguration
from prefect.server.database.dependencies import temporary_database_config
from prefect.server.utilities.database import get_dialect
from prefect.settings import PREFECT_API_DATABASE_CONNECTION_URL
from sqlalchemy.ext.asyncio import AsyncSession, AsyncSessionTransaction


class QueuedSqlite(AioSqliteConfiguration):
    """SQLite whose transactions take the write lock when they begin: BEGIN IMMEDIATE."""

    @asynccontextmanager
    async def begin_transaction(
        self, session: AsyncSession, with_for_update: bool = True
    ) -> AsyncIterator[AsyncSessionTransaction]:
        """Begin a transaction of a session as a writer, for any query."""
        async with super().begin_transaction(session, with_for_update=True) as transaction:
            yield transaction


@contextmanager
def queued_writers() -> Iterator[None]:
    """Let the writers of a server of this process with an SQLite database wait for each other."""
    address = str(PREFECT_API_DATABASE_CONNECTION_URL.value())
    if get_dialect(address).name != "sqlite":
        yield
        return
    with temporary_database_config(QueuedSqlite(connection_url=address)):
        yield
