"""The asynchronous client with the methods of the other, so that the same tests are of both."""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import httpx

from service.client import AsyncShapeClient


class Blocking:
    """Waits for what the client answers."""

    def __init__(self, client: AsyncShapeClient, runner: asyncio.Runner) -> None:
        self._client = client
        self._runner = runner

    def __getattr__(self, name: str) -> Callable[..., Any]:
        method = getattr(self._client, name)

        def call(*arguments: Any, **named: Any) -> Any:
            answer = method(*arguments, **named)
            return self._runner.run(answer if inspect.iscoroutine(answer) else _all(answer))

        return call


@contextmanager
def blocking(url: str, note: Callable[[httpx.Response], object]) -> Iterator[Blocking]:
    """A client of a service, which tells of each answer."""

    async def noted(response: httpx.Response) -> None:
        note(response)

    http = httpx.AsyncClient(event_hooks={"response": [noted]}, trust_env=False)
    with asyncio.Runner() as runner:
        yield Blocking(AsyncShapeClient(url, http=http), runner)
        runner.run(http.aclose())


async def _all(series: Any) -> list[Any]:
    return [item async for item in series]
