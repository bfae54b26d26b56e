"""The client that blocks."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

import httpx

from service.client.blocking.jobs import JobCalls
from service.client.blocking.served import ServedCalls
from service.client.blocking.shapes import ShapeCalls
from service.client.config import Config
from service.client.drivers import Driver
from service.client.retry import Retry


class ShapeClient(ShapeCalls, JobCalls, ServedCalls):
    """The service, as calls that block.

        with ShapeClient("https://shapes.example") as client:
            client.edit("chair.glb", {"seat_width": scale(1.2)}).save("wide.glb")

    It may be shared by threads.  Every call makes its attempts as `Retry` says, sends a mesh again
    that the service has dropped, and raises `ServiceError`s: see `service.client.errors`.  A mesh
    is a path, bytes, a binary file, a `Mesh`, a file that was answered, or a mesh_id.  A wrong
    argument is a TypeError or ValueError, and a file that can't be read or written an OSError.

    Args:
        url: of the service; by default that of `http`, else `SHAPE_URL` of the environment, else
            http://127.0.0.1:8000.
        api_key: by default `SHAPE_API_KEY` of the environment; empty for none.  It goes to the
            service alone: redirects are not followed, and nothing shows it.
        timeout: seconds or `httpx.Timeout` of each call.
        retries: how calls are made again; `Retry(attempts=1)` for never.
        http: an `httpx.Client` to use; it is left open.
        transport: instead, what an own one is to send with.
        sleep: waits so many seconds.

    Raises:
        ValueError: when the URL or the key can't be one.
    """

    def __init__(
        self,
        url: str | None = None,
        api_key: str | None = None,
        timeout: float | httpx.Timeout | None = None,
        retries: Retry | None = None,
        http: httpx.Client | None = None,
        transport: httpx.BaseTransport | None = None,
        sleep: Callable[[float], object] = time.sleep,
    ) -> None:
        at = "" if http is None else str(http.base_url)
        self._config = Config.of(url, api_key, timeout, retries, at)
        self._own = http is None
        self._http = http or httpx.Client(transport=transport)
        self._driver = Driver(self._http, sleep)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._config.shown!r})"

    def close(self) -> None:
        """Close its connections."""
        if self._own:
            self._http.close()
