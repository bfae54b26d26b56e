"""How much is taken in at once; what comes beyond is turned away before its body is read."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field

from anyio import sleep
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.framing import declared_bytes
from service.api.problems import from_http
from service.api.workers import Workers

PROMPT_S = 1.0
"""Seconds within which a body comes on an ordinary network."""

SMALL = 64 * 1024
"""Bytes of a body that come in however many are held: as many as come with a `mesh_id`."""

REFUSALS = 40
"""Requests a second that are told at once that there is no room."""

LONGEST_HOLD_S = 1.5
"""How long those beyond are held before they are told, in seconds."""


@dataclass(eq=False)
class Request:
    """A request that was let in.

    Its place, and the bytes that it declared, are kept for it while its body may be expected to
    come at once.  One that is slow to come counts by what has come, and takes a place when it is
    whole: a few slow clients can't hold all that there is.
    """

    declared: int
    begun: float = field(default_factory=time.monotonic)
    received: int = 0
    whole: bool = False
    answered: bool = False

    @property
    def _prompt(self) -> bool:
        return time.monotonic() - self.begun < PROMPT_S

    @property
    def has_place(self) -> bool:
        """Whether it is worked on, waits for a worker, or is about to."""
        return not self.answered and (self.whole or self._prompt)

    @property
    def bytes(self) -> int:
        """That are held for it."""
        promised = self.declared if self._prompt else 0
        return self.received if self.whole else max(self.received, promised)


class Admission:
    """Who is in: at most `places` requests in work or queue, and `most_bytes` of their bodies.

    A single body may be larger.  For the event loop's thread alone.

    Attributes:
        rejected: requests turned away so far, by what there was no room for.
    """

    def __init__(self, workers: Workers, queue: int, most_bytes: int) -> None:
        """`queue` is how many may wait for a worker."""
        self.places = workers.count + queue
        self.most_bytes = most_bytes
        self.rejected = {"places": 0, "bytes": 0}
        self._workers = workers
        self._inside: set[Request] = set()
        self._told = -math.inf

    @property
    def held(self) -> int:
        """Requests that have a place."""
        return sum(request.has_place for request in self._inside)

    @property
    def held_bytes(self) -> int:
        """Bytes of bodies, come or declared."""
        return sum(request.bytes for request in self._inside)

    @property
    def retry_after(self) -> int:
        """Whole seconds in which the workers get through what is here now, at least 1."""
        return max(1, math.ceil(self.held * self._workers.pace / self._workers.count))

    def hold(self) -> float:
        """Seconds to let a client wait that is to be refused now.

        Refusals are cheap, not free: clients that come back at once, in spite of `Retry-After`,
        would take the CPUs from those that are inside.
        """
        now = time.monotonic()
        # A second's worth may go out at once.
        self._told = min(max(self._told + 1 / REFUSALS, now - 1.0), now + LONGEST_HOLD_S)
        return max(self._told - now, 0.0)

    def enter(self, declared: int) -> Request:
        """Let a request in whose body has so many bytes, as far as is known.

        Raises:
            HTTPException: 429, there is no room.
        """
        if self.held >= self.places:
            raise self._full("places", f"All {self.places} places in work and in queue are taken.")
        request = Request(declared)
        self._inside.add(request)
        try:
            self._check_bytes(request)
        except HTTPException:
            self._inside.remove(request)
            raise
        return request

    def leave(self, request: Request) -> None:
        """It has been answered, or will never be."""
        self._inside.remove(request)

    def receive(self, request: Request, count: int, whole: bool) -> None:
        """Note bytes of its body, and whether that has ended.

        Raises:
            HTTPException: 429, there is no room for so much, or for this request any more.
        """
        had_place = request.has_place
        request.received += count
        self._check_bytes(request)
        # What came slowly but whole is let into a longer queue before it is thrown away.
        if whole and not had_place and self.held >= 2 * self.places:
            raise self._full(
                "places", "While the body came, all places in work and in queue were taken."
            )
        request.whole = whole

    def _check_bytes(self, request: Request) -> None:
        alone = len(self._inside) == 1
        if not alone and request.bytes > SMALL and self.held_bytes > self.most_bytes:
            raise self._full("bytes", f"Bodies of {self.most_bytes} bytes are held already.")

    def _full(self, reason: str, detail: str) -> HTTPException:
        self.rejected[reason] += 1
        return HTTPException(429, detail, {"Retry-After": str(self.retry_after)})


class Admit:
    """Middleware: lets POST requests in, or answers 429 before their body is read.

    A body that runs over the bytes while it streams raises the 429 where it is read.
    """

    def __init__(self, app: ASGIApp, admission: Admission) -> None:
        self.app = app
        self.admission = admission

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["method"] != "POST":
            await self.app(scope, receive, send)
            return
        try:
            request = self.admission.enter(declared_bytes(Headers(scope=scope)))
        except HTTPException as error:
            await sleep(self.admission.hold())
            await from_http(scope, error)(scope, receive, send)
            return

        async def counted() -> Message:
            message = await receive()
            if message["type"] == "http.request" and not request.whole:
                more = message.get("more_body", False)
                self.admission.receive(request, len(message.get("body", b"")), not more)
            return message

        async def answered(message: Message) -> None:
            # From here on it takes no worker; its bytes are held until the client has the answer.
            request.answered = True
            await send(message)

        try:
            await self.app(scope, counted, answered)
        finally:
            self.admission.leave(request)
