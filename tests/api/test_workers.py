from __future__ import annotations

import asyncio
import os
import sys
import threading
import time
from collections.abc import Awaitable, Callable
from typing import Any

import anyio
import anyio.to_thread
import pytest
from fastapi import Request
from starlette.types import Message

from service import deadline, stages
from service.api.left import ClientLeft
from service.api.workers import NICENESS, Workers
from service.errors import Overloaded, TooLarge
from service.mesh import limits


class Caller:
    """A request whose client can be made to leave."""

    def __init__(self, **state: Any) -> None:
        self.left = anyio.Event()
        self.request = Request({"type": "http", "state": state}, self._receive)

    async def _receive(self) -> Message:
        await self.left.wait()
        return {"type": "http.disconnect"}

    def leave(self) -> None:
        self.left.set()


async def until(happens: Callable[[], bool]) -> None:
    with anyio.fail_after(20):
        while not happens():
            await anyio.sleep(0.001)


async def expect(error: type[BaseException], awaitable: Awaitable[Any]) -> None:
    with pytest.raises(error):
        await awaitable


def test_no_more_than_count_run_at_once() -> None:
    entered = threading.Semaphore(0)
    gate = threading.Event()

    def work() -> None:
        entered.release()
        assert gate.wait(20)

    def watch() -> list[bool]:
        try:
            return [entered.acquire(timeout=10), entered.acquire(timeout=10),
                    entered.acquire(timeout=0.3)]  # fmt: skip
        finally:
            gate.set()

    async def six() -> list[bool]:
        workers = Workers(2)
        async with anyio.create_task_group() as tasks:
            for _ in range(6):
                tasks.start_soon(workers.run, Caller().request, work)
            await until(lambda: workers.working == 2 and workers.queued == 4)
            result = await anyio.to_thread.run_sync(watch)
        assert (workers.working, workers.queued) == (0, 0)
        return result

    assert anyio.run(six) == [True, True, False]
    assert all(entered.acquire(blocking=False) for _ in range(4))


def test_first_come_first_served() -> None:
    order: list[int] = []

    async def eight() -> None:
        workers = Workers(1)
        async with anyio.create_task_group() as tasks:
            for number in range(8):
                tasks.start_soon(workers.run, Caller().request, order.append, number)
                await until(lambda number=number: workers.queued + len(order) > number)

    anyio.run(eight)
    assert order == list(range(8))


def test_results_and_errors_come_back() -> None:
    async def divide(a: int, b: int) -> float:
        return await Workers(1).run(Caller().request, lambda x, y: x / y, a, b)

    assert anyio.run(divide, 6, 3) == 2.0
    with pytest.raises(ZeroDivisionError):
        anyio.run(divide, 1, 0)


def test_each_function_has_its_own_deadline() -> None:
    def work(seconds: float) -> str:
        time.sleep(seconds)
        deadline.check()
        return "done"

    async def two() -> str:
        workers = Workers(1, 0.05)
        with pytest.raises(Overloaded):
            await workers.run(Caller().request, work, 0.1)
        # What others took before is no part of it.
        return await workers.run(Caller().request, work, 0.0)

    assert anyio.run(two) == "done"
    deadline.check()


def test_what_waited_longer_than_the_deadline_is_not_begun() -> None:
    gate = threading.Event()
    begun: list[int] = []

    async def wait_too_long() -> None:
        workers = Workers(1, 0.05)
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(workers.run, Caller().request, gate.wait, 20)
            await until(lambda: workers.working == 1)
            tasks.start_soon(expect, Overloaded, workers.run(Caller().request, begun.append, 1))
            await until(lambda: workers.queued == 1)
            await anyio.sleep(0.06)
            gate.set()
        await workers.run(Caller().request, begun.append, 2)

    anyio.run(wait_too_long)
    assert begun == [2]


def test_a_client_that_leaves_the_queue_leaves_its_place() -> None:
    gate = threading.Event()
    begun: list[int] = []

    async def leave() -> None:
        workers = Workers(1)
        caller = Caller()
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(workers.run, Caller().request, gate.wait, 20)
            await until(lambda: workers.working == 1)
            tasks.start_soon(expect, ClientLeft, workers.run(caller.request, begun.append, 1))
            await until(lambda: workers.queued == 1)
            caller.leave()
            await until(lambda: workers.queued == 0)
            assert workers.working == 1
            gate.set()

    anyio.run(leave)
    assert begun == []


def test_work_for_a_client_that_left_ends_where_it_looks() -> None:
    entered, ended = threading.Event(), threading.Event()

    def work() -> None:
        entered.set()
        try:
            while True:
                deadline.check()
                time.sleep(0.001)
        finally:
            ended.set()

    async def leave() -> None:
        workers = Workers(1)
        caller = Caller()
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(expect, ClientLeft, workers.run(caller.request, work))
            await until(entered.is_set)
            caller.leave()
        assert ended.is_set()
        assert workers.working == 0

    anyio.run(leave)


def test_work_whose_request_the_server_cancels_ends_too() -> None:
    entered, ended = threading.Event(), threading.Event()

    def work() -> None:
        entered.set()
        try:
            while True:
                deadline.check()
                time.sleep(0.001)
        finally:
            ended.set()

    async def cancel() -> None:
        workers = Workers(1)
        task = asyncio.create_task(workers.run(Caller().request, work))
        await until(entered.is_set)
        task.cancel()
        await expect(asyncio.CancelledError, task)
        await until(ended.is_set)
        assert workers.working == 0

    anyio.run(cancel)


def test_the_wait_and_the_stages_are_recorded() -> None:
    gate = threading.Event()
    record = stages.Record()

    def work() -> None:
        with stages.stage("encode"):
            time.sleep(0.01)

    async def queue() -> None:
        workers = Workers(1)
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(workers.run, Caller().request, gate.wait, 20)
            await until(lambda: workers.working == 1)
            tasks.start_soon(workers.run, Caller(record=record).request, work)
            await until(lambda: workers.queued == 1)
            await anyio.sleep(0.02)
            gate.set()

    anyio.run(queue)
    assert list(record.seconds) == ["queue", "encode"]
    assert record.seconds["queue"] >= 0.02
    assert record.seconds["encode"] >= 0.01


def test_the_pace_is_that_of_requests() -> None:
    async def work() -> float:
        workers = Workers(1)
        assert workers.pace == 0
        for _ in range(3):
            await workers.run(Caller().request, time.sleep, 0.02)
        return workers.pace

    assert anyio.run(work) >= 0.02


@pytest.mark.skipif(sys.platform != "linux", reason="threads have priorities on Linux alone")
def test_threads_that_work_stand_back_behind_the_event_loop() -> None:
    def niceness() -> int:
        return os.getpriority(os.PRIO_PROCESS, threading.get_native_id())

    async def twice() -> list[int]:
        workers = Workers(1)
        return [await workers.run(Caller().request, niceness) for _ in range(2)]

    own = niceness()
    assert anyio.run(twice) == [min(own + NICENESS, 19)] * 2
    assert niceness() == own


def test_meshes_are_no_larger_than_there_is_memory_for() -> None:
    async def read(vertices: int) -> None:
        await Workers(1, vertices=5).run(Caller().request, limits.check_vertices, vertices)

    anyio.run(read, 5)
    with pytest.raises(TooLarge):
        anyio.run(read, 6)
    limits.check_vertices(6)
