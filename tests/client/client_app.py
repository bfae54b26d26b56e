"""A stand-in for what a real server can't be made to do on demand: scripted answers."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

import httpx

from service.client import AsyncShapeClient, Retry, ShapeClient

Answer = httpx.Response | Exception

URL = "http://shapes.test"


class Script:
    """Answers requests in turn, and notes them and the seconds that were slept."""

    def __init__(self, *answers: Answer | Callable[[httpx.Request], httpx.Response]) -> None:
        self.answers: list[Any] = list(answers)
        self.requests: list[httpx.Request] = []
        self.slept: list[float] = []
        self.now = 0.0

    def __call__(self, request: httpx.Request) -> httpx.Response:
        request.read()
        self.requests.append(request)
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer if isinstance(answer, httpx.Response) else answer(request)

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now += seconds

    def client(self, **given: Any) -> ShapeClient:
        """A client that this answers; jitter is always half."""
        transport = httpx.MockTransport(self)
        return ShapeClient(URL, retries=self._retry(given), transport=transport, sleep=self.sleep)

    def asynchronous(self, **given: Any) -> AsyncShapeClient:
        """The same, to await."""

        async def sleep(seconds: float) -> None:
            self.sleep(seconds)

        transport = httpx.MockTransport(self)
        return AsyncShapeClient(URL, retries=self._retry(given), transport=transport, sleep=sleep)

    def _retry(self, given: dict[str, Any]) -> Retry:
        return Retry(random=lambda: 0.5, clock=lambda: self.now, **given)


def refused(status: int, code: str, **headers: str) -> httpx.Response:
    """A problem."""
    document = {"type": "about:blank", "title": "No", "status": status, "detail": "It is so.",
                "code": code, "suggestion": "Do else.", "trace_id": "4b"}  # fmt: skip
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    kind = {"content-type": "application/problem+json"}
    return httpx.Response(status, json=document, headers={**named, **kind})


def alive() -> httpx.Response:
    """A success."""
    return httpx.Response(200, json={"status": "alive"})


def job(status: str, done: int = 0, **more: Any) -> dict[str, Any]:
    """A job document."""
    links = {"self": "/jobs/job-1", "events": "/jobs/job-1/events", "result": "/jobs/job-1/result"}
    return {"id": "job-1", "kind": "edit", "status": status, "created": "2026-01-01T00:00:00Z",
            "progress": {"done": done, "total": 2}, "started": None, "finished": None,
            "expires": "2026-01-02T00:00:00Z", "durable": True, "problem": None,
            "links": links, **more}  # fmt: skip


def stream(*events: Sequence[Any], begins: str = ": hello\n\n") -> httpx.Response:
    """Server-sent events: pairs of an id and a job."""
    text = "".join(f"id: {n}\nevent: status\ndata: {json.dumps(j)}\n\n" for n, j in events)
    return httpx.Response(
        200, content=(begins + text).encode(), headers={"content-type": "text/event-stream"}
    )
