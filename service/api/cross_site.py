"""Pages of other origins that make a browser send what they could not read the answer to."""

from __future__ import annotations

from collections.abc import Collection

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from service.api.problems import Problem

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
OWN = frozenset({"same-origin", "none"})
"""What browsers say (Fetch Metadata) of requests by the service's own pages, or by the user."""


class CrossSite:
    """Middleware: refuses what a browser says that a page of another origin sends.

    Without it any page could have the service work, though CORS keeps the answers from it.  Other
    clients than browsers say nothing of the kind and pass.
    """

    def __init__(self, app: ASGIApp, origins: Collection[str]) -> None:
        """`origins` are those whose pages may call."""
        self.app = app
        self.origins = origins

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http" and scope["method"] not in SAFE_METHODS:
            headers = Headers(scope=scope)
            site, origin = headers.get("sec-fetch-site", "none"), headers.get("origin", "")
            if site not in OWN and origin not in self.origins:
                problem = Problem(
                    403,
                    "cross_site",
                    f"A page of {origin[:80] or 'another origin'} may not make this call.",
                    "The operator lets pages of other origins in by CORS_ORIGINS.",
                    scope["state"]["trace_id"],
                )
                await problem(scope, receive, send)
                return
        await self.app(scope, receive, send)
