"""The HTTP server: uvicorn's, which ends in good order and lets no client hold it up."""

from __future__ import annotations

import asyncio
import logging
import signal
import socket
from types import FrameType

import uvicorn
from fastapi import FastAPI

from service.api.context import Context
from service.api.metrics import Metrics
from service.protocol import Connection
from service.settings import Settings

SWEEP_S = 0.5
"""Between two looks at all connections, in seconds."""

CLOSE = (b"connection", b"close")

logger = logging.getLogger(__name__)


class Config(uvicorn.Config):
    """uvicorn's configuration, and what `Connection` goes by beyond it."""

    def __init__(self, app: FastAPI, settings: Settings) -> None:
        super().__init__(
            app,
            http=Connection,
            ws="none",
            lifespan="on",
            # uvicorn's lines go through the root logger, like all others; requests have theirs.
            log_config=None,
            access_log=False,
            server_header=False,
            timeout_keep_alive=settings.keep_alive_seconds,  # type: ignore[arg-type]
        )
        self.max_connections = settings.max_connections
        self.header_seconds = settings.header_seconds
        self.body_seconds = settings.body_seconds
        self.drain_seconds = settings.drain_seconds
        self.grace_seconds = settings.grace_seconds
        self.metrics: Metrics = app.state.context.metrics


class Server(uvicorn.Server):
    """Serves until SIGTERM or SIGINT (Ctrl-C).

    SIGTERM turns readiness off and goes on serving for ``drain_seconds``, so that load balancers
    notice; SIGINT skips that.  Then nothing new is taken, and what is in work has
    ``grace_seconds``.  A second signal ends it at once.

    Attributes:
        complete: whether everything was answered before the end.
    """

    config: Config

    def __init__(self, config: Config, context: Context) -> None:
        super().__init__(config)
        self.complete = True
        self._readiness = context.readiness
        connections = self.server_state.connections
        config.metrics.connections.set_function(lambda: len(connections))
        self._signalled = False
        self._drained_at: float | None = None
        self._sweeper: asyncio.Task[None] | None = None

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        self._sweeper = asyncio.create_task(self._sweep())
        for listener in sockets or []:
            logger.info("running on %s (Ctrl-C stops it)", url(listener))

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Note a signal; uvicorn would raise it again in the end, for the exit status."""
        if self._signalled:
            self.should_exit = self.force_exit = True
        elif sig == signal.SIGTERM:
            # Whoever sees that it drains finds its connection closed, too.
            self._close_connections_once_answered()
            self._readiness.drain()
        else:
            self.should_exit = True
        self._signalled = True

    async def on_tick(self, counter: int) -> bool:
        over = await super().on_tick(counter)
        if self._readiness.draining:
            now = asyncio.get_running_loop().time()
            if self._drained_at is None:
                logger.info("draining for %g s", self.config.drain_seconds)
                self._drained_at = now + self.config.drain_seconds
            over = over or now >= self._drained_at
        return over

    def _close_connections_once_answered(self) -> None:
        if CLOSE in self.config.encoded_headers:
            return
        self.config.encoded_headers.append(CLOSE)
        self.server_state.default_headers = [*self.server_state.default_headers, CLOSE]

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        logger.info("stopping: %d requests in work", len(self.server_state.tasks))
        self._readiness.drain()
        for server in self.servers:
            server.close()
        for listener in sockets or []:
            listener.close()
        self._close_connections_once_answered()
        for connection in list(self.server_state.connections):
            connection.shutdown()
        await self._settled(self.config.grace_seconds)
        self.complete = not self.server_state.tasks
        for connection in list(self.server_state.connections):
            connection.transport.abort()
        if not self.complete:
            logger.error("stopped with %d requests in work", len(self.server_state.tasks))
            for task in list(self.server_state.tasks):
                task.cancel()
        elif not self.force_exit:
            await self.lifespan.shutdown()
        if self._sweeper is not None:
            self._sweeper.cancel()

    async def _settled(self, seconds: float) -> None:
        """Wait for all requests to be answered, so long at most, or until a second signal."""
        state = self.server_state
        end = asyncio.get_running_loop().time() + seconds
        while (state.tasks or state.connections) and not self.force_exit:
            if asyncio.get_running_loop().time() >= end:
                return
            await asyncio.sleep(0.02)

    async def _sweep(self) -> None:
        while True:
            await asyncio.sleep(SWEEP_S)
            for connection in list(self.server_state.connections):
                assert isinstance(connection, Connection)
                connection.sweep()


def listen(host: str, port: int) -> list[socket.socket]:
    """Sockets that listen on every address of the host; OSError when one can't be had.

    Args:
        port: 0 takes a free one, on the first address alone.
    """
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    addresses = list(dict.fromkeys((family, address) for family, _, _, _, address in found))
    listeners: list[socket.socket] = []
    try:
        for family, address in addresses[: None if port else 1]:
            listener = socket.create_server(address[:2], family=family, backlog=2048)
            listeners.append(listener)
            # Connections have it from here. Without, an answer's body waits 40 ms for the client
            # to acknowledge the head.
            listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    except OSError:
        for listener in listeners:
            listener.close()
        raise
    return listeners


def url(listener: socket.socket) -> str:
    """Where a client finds it."""
    host, port = listener.getsockname()[:2]
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"
