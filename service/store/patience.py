"""Calls of something far away, which may hang or be gone."""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Event, Lock, Semaphore, Thread
from typing import Any, TypeVar, TypeVarTuple

T = TypeVar("T")
Arguments = TypeVarTuple("Arguments")

LONGEST_PAUSE = 60.0


class Unreachable(Exception):
    """It failed a moment ago and is left alone, or did not answer in time."""


class Patience:
    """Lets a few calls at a time take so long, and leaves what failed alone for a while.

    After that a single call tries it, while others are turned away at once; each trial that fails
    doubles the pause, up to a minute.  So an outage costs one request its wait now and then.  A
    call that hangs goes on in its own thread, which does not keep the process from ending.
    """

    def __init__(self, seconds: float, at_once: int, pause: float) -> None:
        """
        Args:
            seconds: that a call may take, the wait for its turn included.
            at_once: calls that may be under way, hanging ones too.
            pause: seconds without any call after one that failed.
        """
        self._seconds = seconds
        self._pause = pause
        self._turns = Semaphore(at_once)
        self._lock = Lock()
        self._failures = 0
        self._resume = 0.0

    def run(self, function: Callable[[*Arguments], T], *arguments: *Arguments) -> T:
        """The function's result.

        A FileNotFoundError of it is an answer like any other.

        Raises:
            Unreachable: when it is too late or too soon.
            Exception: what the function raises.
        """
        end = time.monotonic() + self._seconds
        with self._lock:
            if self._failures and time.monotonic() < self._resume:
                raise Unreachable("it failed a moment ago")
            # Until this call has ended, or should have, it is the only trial.
            self._resume = end
        try:
            result = self._within(end, lambda: function(*arguments))
        except FileNotFoundError:
            self._succeeded()
            raise
        except Exception:
            self._failed()
            raise
        self._succeeded()
        return result

    def _within(self, end: float, call: Callable[[], T]) -> T:
        if not self._turns.acquire(timeout=self._seconds):
            raise self._late()
        done = Event()
        outcome: list[tuple[Any, Exception | None]] = []

        def work() -> None:
            try:
                outcome.append((call(), None))
            except Exception as error:
                outcome.append((None, error))
            finally:
                self._turns.release()
                done.set()

        Thread(target=work, name="shared store", daemon=True).start()
        if not done.wait(end - time.monotonic()):
            raise self._late()
        result, error = outcome[0]
        if error is not None:
            raise error
        return result

    def _succeeded(self) -> None:
        with self._lock:
            self._failures = 0

    def _failed(self) -> None:
        with self._lock:
            pause = min(self._pause * 2.0 ** min(self._failures, 20), LONGEST_PAUSE)
            self._failures += 1
            self._resume = time.monotonic() + pause

    def _late(self) -> Unreachable:
        return Unreachable(f"no answer within {self._seconds:g} s")
