from __future__ import annotations

import threading
import time

import anyio
import anyio.to_thread
import pytest

from service import deadline
from service.api.workers import Workers
from service.errors import Overloaded


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
                tasks.start_soon(workers.run, work)
            return await anyio.to_thread.run_sync(watch)

    assert anyio.run(six) == [True, True, False]
    assert all(entered.acquire(blocking=False) for _ in range(4))


def test_results_and_errors_come_back() -> None:
    async def divide(a: int, b: int) -> float:
        return await Workers(1).run(lambda x, y: x / y, a, b)

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
            await workers.run(work, 0.1)
        # Not even one that waited for its thread all that time has less.
        return await workers.run(work, 0.0)

    assert anyio.run(two) == "done"
    deadline.check()
