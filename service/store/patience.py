"""Calls of something far away, which may hang or be gone."""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Event, Semaphore, Thread
from typing import Any, TypeVar, TypeVarTuple

T = TypeVar("T")
Arguments = TypeVarTuple("Arguments")


class Unreachable(Exception):
    """It failed a moment ago and is left alone, or did not answer in time."""


class Patience:
    """Lets a few calls at a time take so long, and leaves what failed alone for a while.

    So an outage costs one wait now and then, not one a request.  A call that hangs goes on in its
    own thread, which does not keep the process from ending.
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
        self._resume = -float("inf")

    def run(self, function: Callable[[*Arguments], T], *arguments: *Arguments) -> T:
        """The function's result.

        A FileNotFoundError of it is an answer like any other.

        Raises:
            Unreachable: when it is too late or too soon.
            Exception: what the function raises.
        """
        end = time.monotonic() + self._seconds
        if time.monotonic() < self._resume:
            raise Unreachable("it failed a moment ago")
        if not self._turns.acquire(timeout=self._seconds):
            raise self._late()
        done = Event()
        outcome: list[Any] = []

        def call() -> None:
            try:
                outcome.append((function(*arguments), None))
            except Exception as error:
                outcome.append((None, error))
            finally:
                self._turns.release()
                done.set()

        Thread(target=call, name="shared store", daemon=True).start()
        if not done.wait(end - time.monotonic()):
            raise self._late()
        result, error = outcome[0]
        if error is None:
            return result
        if not isinstance(error, FileNotFoundError):
            self._resume = time.monotonic() + self._pause
        raise error

    def _late(self) -> Unreachable:
        self._resume = time.monotonic() + self._pause
        return Unreachable(f"no answer within {self._seconds:g} s")
