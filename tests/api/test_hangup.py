from __future__ import annotations

import os
import signal
import threading
from types import SimpleNamespace
from typing import Any

import anyio

from service.api.hangup import can_listen, reload_on_hangup


def test_each_hangup_reloads() -> None:
    seen: list[int] = []
    read: list[int] = []

    async def hang_up_twice() -> None:
        reloaded = anyio.Semaphore(0)

        async def reload() -> None:
            seen.append(1)
            reloaded.release()

        readiness: Any = SimpleNamespace(reload=reload)
        keys: Any = SimpleNamespace(reload=lambda: read.append(1))
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(reload_on_hangup, readiness, keys)
            await anyio.sleep(0.05)
            for _ in range(2):
                os.kill(os.getpid(), signal.SIGHUP)
                with anyio.fail_after(10):
                    await reloaded.acquire()
            tasks.cancel_scope.cancel()

    before = signal.getsignal(signal.SIGHUP)
    anyio.run(hang_up_twice)
    assert len(seen) == len(read) == 2
    assert signal.getsignal(signal.SIGHUP) == before


def test_only_the_main_thread_can_listen() -> None:
    assert can_listen()
    answers: list[bool] = []
    thread = threading.Thread(target=lambda: answers.append(can_listen()))
    thread.start()
    thread.join()
    assert answers == [False]
