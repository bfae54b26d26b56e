"""A job's course: told by the service's events, or asked for where there are none."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace
from typing import Any

import httpx
from pydantic import ValidationError

from service.client import calls
from service.client.call import JSON, Answer, Call, Sending, as_is, as_model
from service.client.config import Config
from service.client.errors import ProblemError, ServiceError, TimedOut
from service.client.exchange import (
    Chunk,
    Send,
    Sleep,
    Step,
    exchange,
    malformed,
    refusal,
    request_of,
    translated,
)
from service.client.models import Event, Job
from service.client.retry import Attempts, passes
from service.client.sse import Parser

STREAM = "text/event-stream"
KIND = "status"
"""Of the events that tell of a job; others may come to be."""
SILENCE_S = 60.0
"""The service sends comments more often than that."""
POLL_S = 1.0


@dataclass(frozen=True)
class Emit:
    """Hand an event to whoever follows."""

    event: Event


Course = Generator[Step | Emit, Any, None]


class Follow:
    """Follows one job to its end.

    Args:
        job: or its id.
        config: whom to ask.
        timeout: seconds after which to give up; None for never.
        last: the id of an event, to hear but what came after.
    """

    def __init__(
        self, job: Job | str, config: Config, timeout: float | None = None, last: str | None = None
    ) -> None:
        self.job, self.config, self.last = job, config, last
        self.timeout = timeout
        self.clock = config.retry.clock
        self.began = self.clock()
        self.seen: Job | None = None
        self.pause = 0.0

    def steps(self) -> Course:
        """All of it.

        Raises:
            TimedOut: when the job is not finished in time.
            ServiceError: when the service refuses, or can't be reached as often as `Retry` says.
        """
        attempts = Attempts(self.config.retry)
        while not self._over():
            self.left()
            before = self.seen
            try:
                streamed = yield from self._events()
            except ServiceError as fault:
                if not passes(fault):
                    raise
                self.left()
                if self.seen is not before:
                    attempts = Attempts(self.config.retry)
                seconds = max(attempts.delay(fault), self.pause)
                if isinstance(fault, ProblemError) and fault.code == "streams_full":
                    attempts = Attempts(self.config.retry)
                    yield from self._poll(once=True)
                else:
                    yield Sleep(self._within(seconds))
                continue
            if not streamed:
                yield from self._poll()
            elif self.seen is not before:
                attempts = Attempts(self.config.retry)
                if not self._over():
                    yield Sleep(self._within(self.pause or POLL_S))
            elif not self._over():
                # A stream that ends without a word, as when the service drains.
                yield from self._poll(once=True)

    def left(self) -> float | None:
        """Seconds that are left.

        Raises:
            TimedOut: when there are none.
        """
        if self.timeout is None:
            return None
        seconds = self.timeout - (self.clock() - self.began)
        if seconds <= 0:
            path = calls.job_path(self.job)
            raise TimedOut(f"{path} is not finished after {self.timeout:g} s")
        return seconds

    def _over(self) -> bool:
        return self.seen is not None and self.seen.is_finished

    def _within(self, seconds: float) -> float:
        left = self.left()
        return seconds if left is None else min(seconds, left)

    def _patience(self) -> Sending:
        """How the service is asked: for no longer than there is time."""
        left = self.left()
        if left is None:
            return Sending()
        own, retry = self.config.timeout, self.config.retry
        read = left if own.read is None else min(own.read, left)
        timeout = httpx.Timeout(connect=own.connect, write=own.write, pool=own.pool, read=read)
        return Sending(timeout=timeout, retry=replace(retry, total_s=min(retry.total_s, left)))

    def _events(self) -> Generator[Step | Emit, Any, bool]:
        """One connection's events; False where the service has no stream of them."""
        headers = {"Accept": f"{STREAM}, {JSON};q=0.1", "Cache-Control": "no-store"}
        if self.last is not None:
            headers["Last-Event-ID"] = self.last
        own = self.config.timeout
        silence = self._within(SILENCE_S)
        timeout = httpx.Timeout(connect=own.connect, write=own.write, pool=own.pool, read=silence)
        path = f"{calls.job_path(self.job)}/events"
        call = Call("GET", path, as_is, headers=headers, how=Sending(timeout=timeout))
        request = request_of(call, self.config)
        with translated(request):
            response: httpx.Response = yield Send(request)
        if not response.is_success:
            fault = yield from refusal(response, self.config)
            if isinstance(fault, ProblemError) and fault.code == "job_unknown":
                raise fault
            if passes(fault):
                raise fault
            return False
        if not response.headers.get("content-type", "").startswith(STREAM):
            return False
        yield from self._listen(response)
        return True

    def _listen(self, response: httpx.Response) -> Course:
        parser = Parser()
        while not self._over():
            with translated(response.request):
                chunk: bytes | None = yield Chunk(response)
            if chunk is None:
                return
            self.left()
            for message in parser.feed(chunk):
                self.last = message.id or self.last
                if message.event != KIND:
                    continue
                try:
                    job = Job.model_validate_json(message.data)
                except ValidationError as error:
                    what = "an event that is no job"
                    raise malformed(what, response, message.data.encode()) from error
                if job != self.seen:  # it may have been asked for meanwhile
                    yield from self._tell(Event(id=message.id, job=job))
            if parser.retry_ms is not None:
                self.pause = min(parser.retry_ms / 1000, self.config.retry.cap_s)

    def _poll(self, once: bool = False) -> Course:
        """Ask until it is finished."""
        while not self._over():
            path = calls.job_path(self.job)
            headers = {"Accept": JSON}
            asking = Call("GET", path, _with_headers, headers=headers, how=self._patience())
            job, answered = yield from exchange(asking, self.config)
            if self.seen is None or job != self.seen:
                yield from self._tell(Event(id=None, job=job))
            if not job.is_finished:
                asked = self.config.retry.after(answered.get("retry-after"))
                yield Sleep(self._within(POLL_S if asked is None else asked))
            if once:
                return

    def _tell(self, event: Event) -> Course:
        self.seen = event.job
        yield Emit(event)


def _with_headers(answer: Answer) -> tuple[Job, httpx.Headers]:
    return as_model(Job)(answer), answer.headers
