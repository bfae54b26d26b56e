"""The client that awaits."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from types import TracebackType
from typing import Self

import httpx

from service.client.awaiting.jobs import JobCalls
from service.client.awaiting.served import ServedCalls
from service.client.awaiting.shapes import ShapeCalls
from service.client.config import Config
from service.client.drivers import AsyncDriver
from service.client.retry import Retry


class AsyncShapeClient(ShapeCalls, JobCalls, ServedCalls):
    """The service, as calls to await: what `ShapeClient` does, by the same names.

        async with AsyncShapeClient("https://shapes.example") as client:
            edited = await client.edit("chair.glb", {"seat_width": scale(1.2)})

    Every call makes its attempts as `Retry` says, sends a mesh again that the service has dropped,
    and raises `ServiceError`s: see `service.client.errors`.  A mesh is a path, bytes, a binary
    file, a `Mesh`, a file that was answered, or a mesh_id.  Local files are read and written
    between awaits.

    Args:
        url: of the service; by default that of `http`, else `SHAPE_URL` of the environment, else
            http://127.0.0.1:8000.
        api_key: by default `SHAPE_API_KEY` of the environment; empty for none.  It goes to the
            service alone: redirects are not followed, and nothing shows it.
        timeout: seconds or `httpx.Timeout` of each call.
        retries: how calls are made again; `Retry(attempts=1)` for never.
        http: an `httpx.AsyncClient` to use; it is left open.
        transport: instead, what an own one is to send with: `httpx.ASGITransport(app)` for an app
            in this process.
        sleep: waits so many seconds; another event loop than asyncio's has its own.

    Raises:
        ValueError: when the URL or the key can't be one.
    """

    def __init__(
        self,
        url: str | None = None,
        api_key: str | None = None,
        timeout: float | httpx.Timeout | None = None,
        retries: Retry | None = None,
        http: httpx.AsyncClient | None = None,
        transport: httpx.AsyncBaseTransport | None = None,
        sleep: Callable[[float], Awaitable[object]] = asyncio.sleep,
    ) -> None:
        at = "" if http is None else str(http.base_url)
        self._config = Config.of(url, api_key, timeout, retries, at)
        self._own = http is None
        self._http = http or httpx.AsyncClient(transport=transport)
        self._driver = AsyncDriver(self._http, sleep)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        await self.close()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._config.shown!r})"

    async def close(self) -> None:
        """Close its connections."""
        if self._own:
            await self._http.aclose()
