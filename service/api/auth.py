"""Who may call: those with an API key, where keys are configured."""

from __future__ import annotations

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from service.api.keys import Keys
from service.api.problems import Problem
from service.api.routes import PROBES

OPEN_PATHS = frozenset({"/", "/docs", "/openapi.json"}) | PROBES
"""What needs no key: probes, and pages that hold nobody's data."""

OPEN_FOLDER = "/web/"

HOW = "Send `Authorization: Bearer <key>` or `X-API-Key: <key>`, with a key from the operator."


class Auth:
    """Middleware: answers 401 to requests without a known key, before their body is read.

    Sets ``request.state.owner`` to the name that goes with the key; it is empty where no key is
    needed.
    """

    def __init__(self, app: ASGIApp, keys: Keys) -> None:
        self.app = app
        self.keys = keys

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        state = scope.setdefault("state", {})
        state["owner"] = ""
        if self.keys.wanted and not _is_open(scope["path"]):
            key = _key(Headers(scope=scope))
            owner = self.keys.owner(key) if key else None
            if owner is None:
                await _refusal(bool(key), state["trace_id"])(scope, receive, send)
                return
            state["owner"] = owner
        await self.app(scope, receive, send)


def _is_open(path: str) -> bool:
    return path in OPEN_PATHS or path.startswith(OPEN_FOLDER)


def _key(headers: Headers) -> str:
    """The key that a request carries, empty when it has none."""
    scheme, _, credentials = headers.get("authorization", "").partition(" ")
    if scheme.lower() == "bearer":
        return credentials.strip()
    return headers.get("x-api-key", "").strip()


def _refusal(unknown: bool, trace_id: str) -> Problem:
    code, detail = (
        ("key_unknown", "The API key is not one that is let in.")
        if unknown
        else ("key_missing", "This service wants an API key, and the request has none.")
    )
    challenge = 'Bearer realm="shape-parameters"'
    if unknown:
        challenge += ', error="invalid_token"'
    return Problem(401, code, detail, HOW, trace_id, {"WWW-Authenticate": challenge})
