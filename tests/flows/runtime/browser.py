"""A browser for a web application of this process."""

import asyncio
from typing import Any

import httpx
from starlette.types import ASGIApp


class Web:
    """Sends requests to an application, without a socket."""

    def __init__(self, app: ASGIApp) -> None:
        self._transport = httpx.ASGITransport(app)

    def get(self, path: str, **given: Any) -> httpx.Response:
        return self.request("GET", path, **given)

    def request(self, method: str, path: str, **given: Any) -> httpx.Response:
        async def send() -> httpx.Response:
            async with httpx.AsyncClient(
                transport=self._transport, base_url="http://web"
            ) as client:
                return await client.request(method, path, **given)

        return asyncio.run(send())
