"""Carry out the steps of `exchange`, blocking or not."""

from __future__ import annotations

from collections.abc import AsyncGenerator, AsyncIterator, Awaitable, Callable, Generator, Iterator
from typing import Any, TypeVar

import httpx

from service.client.exchange import Chunk, Read, Send, Sleep, Step
from service.client.follow import Emit
from service.client.models import Event

T = TypeVar("T")


class Driver:
    """Blocks."""

    def __init__(self, http: httpx.Client, sleep: Callable[[float], object]) -> None:
        self.http, self.sleep = http, sleep

    def run(self, steps: Generator[Step, Any, T]) -> T:
        """All steps; what they come to."""
        following = _Following(self)
        try:
            step = next(steps)
            while True:
                step = following.answer(steps, step)
        except StopIteration as end:
            return end.value
        finally:
            following.close()

    def events(self, steps: Generator[Step | Emit, Any, None]) -> Generator[Event, None, None]:
        """All steps; what they emit, as it comes."""
        following = _Following(self)
        try:
            step = next(steps)
            while True:
                if isinstance(step, Emit):
                    yield step.event
                    step = next(steps)
                else:
                    step = following.answer(steps, step)
        except StopIteration:
            return
        finally:
            following.close()


class _Following:
    """The response that is open, and its body."""

    def __init__(self, driver: Driver) -> None:
        self.driver = driver
        self.response: httpx.Response | None = None
        self.chunks: Iterator[bytes] = iter(())

    def answer(self, steps: Generator[Any, Any, Any], step: Step) -> Any:
        """Carry out a step; the next."""
        try:
            done = self.carry_out(step)
        except BaseException as error:
            return steps.throw(error)
        return steps.send(done)

    def carry_out(self, step: Step) -> Any:
        match step:
            case Send(request):
                self.close()
                http = self.driver.http
                response = http.send(request, stream=True, follow_redirects=False)
                self.response, self.chunks = response, response.iter_bytes()
                return response
            case Read(_, sink):
                for chunk in self.chunks:
                    sink.write(chunk)
                sink.finish()
            case Chunk():
                return next(self.chunks, None)
            case Sleep(seconds):
                self.close()
                self.driver.sleep(seconds)
        return None

    def close(self) -> None:
        if self.response is not None:
            self.response.close()
            self.response = None


class AsyncDriver:
    """Awaits."""

    def __init__(
        self, http: httpx.AsyncClient, sleep: Callable[[float], Awaitable[object]]
    ) -> None:
        self.http, self.sleep = http, sleep

    async def run(self, steps: Generator[Step, Any, T]) -> T:
        """All steps; what they come to."""
        following = _AsyncFollowing(self)
        try:
            step = next(steps)
            while True:
                try:
                    done = await following.carry_out(step)
                except BaseException as error:
                    step = steps.throw(error)
                else:
                    step = steps.send(done)
        except StopIteration as end:
            return end.value
        finally:
            await following.close()

    async def events(self, steps: Generator[Step | Emit, Any, None]) -> AsyncGenerator[Event, None]:
        """All steps; what they emit, as it comes."""
        following = _AsyncFollowing(self)
        try:
            step = next(steps)
            while True:
                if isinstance(step, Emit):
                    yield step.event
                    step = next(steps)
                    continue
                try:
                    done = await following.carry_out(step)
                except BaseException as error:
                    step = steps.throw(error)
                else:
                    step = steps.send(done)
        except StopIteration:
            return
        finally:
            await following.close()


class _AsyncFollowing:
    """The response that is open, and its body."""

    def __init__(self, driver: AsyncDriver) -> None:
        self.driver = driver
        self.response: httpx.Response | None = None
        self.chunks: AsyncIterator[bytes] | None = None

    async def carry_out(self, step: Step) -> Any:
        match step:
            case Send(request):
                await self.close()
                http = self.driver.http
                response = await http.send(request, stream=True, follow_redirects=False)
                self.response, self.chunks = response, response.aiter_bytes()
                return response
            case Read(_, sink):
                assert self.chunks is not None
                async for chunk in self.chunks:
                    sink.write(chunk)
                sink.finish()
            case Chunk():
                assert self.chunks is not None
                return await anext(self.chunks, None)
            case Sleep(seconds):
                await self.close()
                await self.driver.sleep(seconds)
        return None

    async def close(self) -> None:
        if self.response is not None:
            await self.response.aclose()
            self.response = None
