"""What nothing foresaw: a 500 that tells nothing of the inside."""

from __future__ import annotations

import logging

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.problems import internal_error

logger = logging.getLogger(__name__)


class Failures:
    """Middleware: logs an error that no handler knows with its trace id, and answers it.

    Within those that add headers, so that a page of another origin can read this answer too.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        started = False

        async def noted(message: Message) -> None:
            nonlocal started
            started = True
            await send(message)

        try:
            await self.app(scope, receive, noted)
        except Exception:
            trace_id = scope["state"]["trace_id"]
            logger.exception("%s %s failed, trace %s", scope["method"], scope["path"], trace_id)
            if started:
                raise
            await internal_error(trace_id)(scope, receive, send)
