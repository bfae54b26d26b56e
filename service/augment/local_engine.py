"""A batch on this machine: worker processes, each with its own models, one source at a time.

A pool of its own, since it must be known which file a worker died or hung on, so that this one is
recorded and left out and the rest goes on.
"""

from __future__ import annotations

import multiprocessing
import signal
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

from service.augment.plan import Outcome, Plan, Task
from service.augment.work import Work
from service.errors import ModelFault

GRACE_S = 30.0
"""Beyond the deadline, after which a worker that does not look at it is ended."""
READY = "ready"
TURNOVER = 500
"""Sources after which a worker gives way to a new one, lest it grow."""


def run_local(
    plan: Plan, tasks: Sequence[Task], workers: int, work: type[Work] = Work
) -> Iterator[Outcome]:
    """Outcomes of the tasks, as they come.

    Args:
        plan: the batch.
        tasks: what to do.
        workers: how many processes.
        work: what each of them does.

    Raises:
        Exception: what a worker could not go on after, such as a full disk.
    """
    todo, crew = deque(tasks), list[_Worker]()
    recorder: Work | None = None
    try:
        for _ in range(min(workers, len(todo))):
            crew.append(_Worker(plan, work))
        while todo or any(worker.task for worker in crew):
            for worker in crew:
                if worker.task is None and todo:
                    worker.give(todo.popleft())
            for place, worker in enumerate(crew):
                if worker.task is None:
                    continue
                answer = worker.answer()
                if answer is None and not worker.lost:
                    continue
                task, worker.task = worker.task, None
                if answer is not None:
                    yield answer
                else:
                    recorder = recorder or work(plan)
                    yield recorder.failed(task, *worker.fault())
                if answer is None or worker.served >= TURNOVER:
                    worker.end()
                    crew[place] = _Worker(plan, work)
            busy = [worker.pipe for worker in crew if worker.task]
            if busy and not any(pipe.poll() for pipe in busy):
                wait(busy, timeout=0.5)
    finally:
        for worker in crew:
            worker.end()


class _Worker:
    """A process, and the source that it is at."""

    def __init__(self, plan: Plan, work: type[Work]) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.task: Task | None = None
        self.served = 0
        self._closed = False
        self._plan, self._ready, self._since = plan, False, time.monotonic()
        self._process: SpawnProcess = context.Process(
            target=_serve, args=(plan, work, theirs), daemon=True
        )
        self._process.start()
        theirs.close()

    def give(self, task: Task) -> None:
        """Send it a source."""
        self.task, self._since = task, time.monotonic()
        # One that is dead is found out when it is asked for the answer.
        with suppress(OSError):
            self.pipe.send(task)

    def answer(self) -> Outcome | None:
        """What became of the source, if it is known."""
        while (message := self._message()) is not None:
            if isinstance(message, BaseException):
                raise message
            if isinstance(message, Outcome):
                self.served += 1
                return message
            self._ready, self._since = True, time.monotonic()
        return None

    def _message(self) -> Any:
        """What it has said next, if anything."""
        try:
            return self.pipe.recv() if self.pipe.poll() else None
        except (EOFError, OSError):
            self._closed = True
            self._process.join(5.0)
            return None

    @property
    def lost(self) -> bool:
        """Whether there will be no answer.

        Raises:
            ModelFault: when it could not even begin.
        """
        if self._closed and not self._ready:
            raise ModelFault(
                "worker_died",
                f"a worker ended before it began, with status {self._process.exitcode}",
                "Free some memory, or ask for fewer workers.",
            )
        return self._closed or self._late

    @property
    def _late(self) -> bool:
        took = time.monotonic() - self._since
        return self._ready and took > self._plan.deadline_s + GRACE_S

    def fault(self) -> tuple[str, str]:
        """Code and detail of why there is no answer."""
        if not self._closed:
            return "worker_hung", f"no end in sight after {self._plan.deadline_s:g} s"
        return "worker_died", f"the worker ended with status {self._process.exitcode}"

    def end(self) -> None:
        """End it, whatever it is at."""
        if self._process.is_alive():
            self._process.terminate()
            self._process.join(2.0)
        if self._process.is_alive():
            self._process.kill()
        self._process.join()
        self.pipe.close()


def _serve(plan: Plan, kind: type[Work], pipe: Connection[Any, Any]) -> None:
    """A worker's life: sources in, outcomes out, until the pipe is closed."""
    # Ctrl-C reaches all processes of a terminal; the one that asked ends the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # A pipe that breaks is that of a run that was ended: there is nobody to tell.
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        try:
            work = kind(plan)
            pipe.send(READY)
            while True:
                task = pipe.recv()
                pipe.send(work(task))
        except (EOFError, BrokenPipeError, ConnectionResetError):
            raise
        except Exception as error:
            pipe.send(error)
