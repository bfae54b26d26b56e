"""One connection: uvicorn's protocol, with bounds on all that a client may be slow at."""

from __future__ import annotations

import secrets
import sys
from typing import TYPE_CHECKING, Any

import h11
from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from service.api.body_limit import RATE
from service.api.problems import Problem
from service.api.routes import PROBES
from service.api.safety import protect

if TYPE_CHECKING:
    import asyncio

    from service.api.metrics import Metrics
    from service.server import Config

SPARE = 32
"""Connections beyond the most that may be open, on which probes are answered and nothing else."""

LINGER_S = 1.0
"""How long a client has to read why its connection closes, in seconds."""


class Connection(H11Protocol):
    """Closed by `sweep` when its client is slower than the configuration allows.

    A client that closes its sending half has left, as far as this service is concerned: whether it
    still listens can't be told.  All is timed by the loop's clock, which never jumps.
    """

    config: Config

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._head_since: float | None = None
        self._stuck_since: float | None = None
        self._unread_since: float | None = None
        self._unread = 0
        self._refused = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._head_since = self.loop.time()
        beyond = len(self.connections) - self.config.max_connections
        if beyond > SPARE:
            transport.abort()
        elif beyond > 0:
            self.app = _probes_only(self.app, self.config.metrics)

    def data_received(self, data: bytes) -> None:
        if self._refused:
            return
        if self._head_since is None and self.conn.their_state is h11.IDLE:
            self._head_since = self.loop.time()
        super().data_received(data)
        if self.conn.their_state is not h11.IDLE:
            self._head_since = None

    def resume_writing(self) -> None:
        self._unread_since = None
        super().resume_writing()

    def sweep(self) -> None:
        """Close the connection if its client has had its time; to be called now and then."""
        now, config = self.loop.time(), self.config
        self._look_at_reader(now)
        self._stuck_since = (self._stuck_since or now) if self._stuck() else None
        if _over(self._unread_since, now, config.body_seconds):
            self.transport.abort()
        elif self.transport.is_closing():
            return
        elif _over(self._stuck_since, now, LINGER_S):
            self.transport.close()
        elif _over(self._head_since, now, config.header_seconds):
            if self.conn.trailing_data[0]:
                self._refuse(408, "head_too_slow", "The request's head did not come in time.")
            else:
                self.transport.close()

    def _look_at_reader(self, now: float) -> None:
        """Note since when the client has taken next to nothing of what is written for it."""
        unread = self.transport.get_write_buffer_size()
        enough = RATE * self.config.body_seconds
        if unread == 0:
            self._unread_since = None
        elif self._unread_since is None or self._unread - unread >= enough:
            self._unread_since, self._unread = now, unread

    def _stuck(self) -> bool:
        """Whether the client may go on sending what nobody wants, after its answer."""
        answered = self.cycle is not None and self.cycle.response_complete
        return self._refused or (answered and self.conn.their_state is h11.SEND_BODY)

    def _unsupported_upgrade_warning(self) -> None:
        """Nothing to warn of: an upgrade is declined by answering as if none were asked for."""

    def send_400_response(self, msg: str) -> None:
        """Answer what can't be read as HTTP; called where the parser's error is handled."""
        error = sys.exc_info()[1]
        if isinstance(error, h11.RemoteProtocolError) and error.error_status_hint == 431:
            self._refuse(431, "head_too_large", "The request's head is too long.")
        else:
            self._refuse(400, "http_malformed", "What came can't be read as an HTTP request.")

    def _refuse(self, status: int, code: str, detail: str) -> None:
        """Answer in the app's stead and end the connection; only that if an answer has begun."""
        self._refused = True
        if self.cycle is not None and not self.cycle.response_complete:
            self.cycle.disconnected = True
            self.cycle.message_event.set()
        if self.conn.our_state not in (h11.IDLE, h11.SEND_RESPONSE):
            self.transport.close()
            return
        problem = _refusal(self.config.metrics, status, code, detail, "Send a request anew.")
        for event in (
            h11.Response(status_code=status, headers=problem.raw_headers),
            h11.Data(data=bytes(problem.body)),
            h11.EndOfMessage(),
        ):
            self.transport.write(self.conn.send(event) or b"")
        # Closed by the sweep: closing it with bytes unread would reset it.
        self.transport.write_eof()


def _over(since: float | None, now: float, seconds: float) -> bool:
    return since is not None and now - since > seconds


def _refusal(metrics: Metrics, status: int, code: str, detail: str, suggestion: str) -> Problem:
    """What the server answers in the app's stead, before it closes the connection."""
    metrics.refuse(code)
    trace_id = secrets.token_hex(16)
    headers = {"Connection": "close", "Trace-Id": trace_id}
    problem = Problem(status, code, detail, suggestion, trace_id, headers)
    protect(problem.headers, status)
    return problem


def _probes_only(app: ASGIApp, metrics: Metrics) -> ASGIApp:
    async def crowded(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["path"] in PROBES:
            await app(scope, receive, send)
            return
        problem = _refusal(
            metrics,
            429,
            "too_many_connections",
            "As many connections are open as this service takes.",
            "Connect again after as many seconds as Retry-After says.",
        )
        problem.headers["Retry-After"] = "1"
        await problem(scope, receive, send)

    return crowded
