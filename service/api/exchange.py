"""One request and its answer, counted and timed as they pass by."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from starlette.datastructures import MutableHeaders
from starlette.types import Message, Receive, Scope, Send

from service.api import left
from service.api.trace import REQUEST_HEADER, TRACE_HEADER
from service.logs import Identity
from service.stages import Record

METHODS = frozenset({"DELETE", "GET", "HEAD", "OPTIONS", "PATCH", "POST", "PUT"})
OTHER_METHOD = "other"


class Exchange:
    """Stands between the server and the app for one request.

    Attributes:
        route: the template of its path.
        record: the stages of its work.
        request_bytes, response_bytes: of the bodies, as far as they came and went.
        receiving: seconds until the whole body had come; None while it has not.
        seconds: how long the exchange has taken so far.
    """

    def __init__(
        self, scope: Scope, receive: Receive, send: Send, identity: Identity, route: str
    ) -> None:
        self.identity = identity
        self.route = route
        self.record = Record()
        self.request_bytes = 0
        self.response_bytes = 0
        self.receiving: float | None = None
        self._scope = scope
        self._receive = receive
        self._send = send
        self._start = time.perf_counter()
        self._status: int | None = None
        self._left = False
        self._failed = False
        state = scope.setdefault("state", {})
        state["trace_id"] = identity.trace_id
        state["request_id"] = identity.request_id
        state["record"] = self.record

    async def receive(self) -> Message:
        """The server's next message to the app."""
        message = await self._receive()
        if message["type"] == "http.request":
            self.request_bytes += len(message.get("body", b""))
            if self.receiving is None and not message.get("more_body", False):
                self.receiving = self.seconds
        elif self._status is None:
            self._left = True
        return message

    async def send(self, message: Message) -> None:
        """The app's next message to the server."""
        if message["type"] == "http.response.start":
            self._status = message["status"]
            headers = MutableHeaders(scope=message)
            headers[TRACE_HEADER] = self.identity.trace_id
            headers[REQUEST_HEADER] = self.identity.request_id
            headers["Server-Timing"] = self._timing()
        elif self._scope["method"] != "HEAD":
            self.response_bytes += len(message.get("body", b""))
        await self._send(message)

    def fail(self) -> None:
        """Note that the app gave up, maybe amid its answer."""
        self._failed = True

    @property
    def seconds(self) -> float:
        return time.perf_counter() - self._start

    @property
    def status(self) -> int:
        """The answer's, `left.STATUS` when nobody waited for it, 500 when it has none or broke."""
        if self._left:
            return left.STATUS
        if self._failed or self._status is None:
            return 500
        return self._status

    @property
    def method(self) -> str:
        """One of `METHODS`, or `OTHER_METHOD`."""
        method: str = self._scope["method"]
        return method if method in METHODS else OTHER_METHOD

    @property
    def path(self) -> str:
        """As the client sent it, decoded."""
        path: str = self._scope["path"]
        return path

    @property
    def owner(self) -> str:
        """Name of the client's API key; empty where there is none."""
        return str(self._scope["state"].get("owner", ""))

    @property
    def report(self) -> Mapping[str, Any]:
        """Of what was inferred or edited; empty where nothing was."""
        report: Mapping[str, Any] = self._scope["state"].get("report", {})
        return report

    @property
    def code(self) -> str:
        """Of the problem that it was answered with; empty where there was none."""
        return str(self._scope["state"].get("code", ""))

    def _timing(self) -> str:
        """Stages so far and the time until now, in milliseconds."""
        seconds = {**self.record.seconds, "total": self.seconds}
        return ", ".join(f"{name};dur={1e3 * value:.1f}" for name, value in seconds.items())
