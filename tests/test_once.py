from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from threading import Event
from typing import Any

import pytest

from service import deadline
from service.once import Flights, Memo
from service.stages import Record, recording


class Slow:
    """A maker that waits until it is let go."""

    def __init__(self, *answers: Any) -> None:
        self.answers = list(answers)
        self.begun, self.go = Event(), Event()
        self.made = 0

    def __call__(self) -> Any:
        self.begun.set()
        assert self.go.wait(10)
        self.made += 1
        answer = self.answers.pop(0)
        if isinstance(answer, BaseException):
            raise answer
        return answer


def nothing() -> None:
    return None


@pytest.fixture
def pool() -> Any:
    with ThreadPoolExecutor(4) as threads:
        yield threads


def waiting(get: Callable[[], Any], pool: ThreadPoolExecutor) -> Future[Any]:
    """A call in another thread, which has come as far as to wait for the first."""
    waits, joined = Event(), threading.Event.wait

    def wait(event: Event, seconds: float | None = None) -> bool:
        if seconds is not None:
            waits.set()
        return joined(event, seconds)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("service.once.Event.wait", wait)
        future = pool.submit(get)
        assert joined(waits, 10)
    return future


def test_two_who_ask_at_once_get_the_same_made_once(pool: ThreadPoolExecutor) -> None:
    flights, slow = Flights(), Slow(["value"])
    first = pool.submit(flights.join, "a", nothing, slow)
    assert slow.begun.wait(10)
    second = waiting(lambda: flights.join("a", nothing, slow), pool)
    assert flights.join("b", nothing, lambda: 5) == 5
    slow.go.set()
    assert first.result(10) is second.result(10)
    assert slow.made == 1


def test_what_is_kept_is_not_made_again() -> None:
    memo, slow = Memo(), Slow(1, 2)
    slow.go.set()
    assert [memo.get("a", slow), memo.get("a", slow), memo.get("b", slow)] == [1, 1, 2]
    assert len(memo) == 2


def test_flights_alone_keep_nothing() -> None:
    flights, slow = Flights(), Slow(1, 2)
    slow.go.set()
    assert [flights.join("a", nothing, slow) for _ in range(2)] == [1, 2]


@pytest.mark.parametrize("error", [ValueError("bad"), deadline.Abandoned()])
def test_the_fault_of_one_is_not_that_of_who_waits(
    pool: ThreadPoolExecutor, error: BaseException
) -> None:
    memo, slow = Memo(), Slow(error, "value")
    first = pool.submit(memo.get, "a", slow)
    assert slow.begun.wait(10)
    second = waiting(lambda: memo.get("a", slow), pool)
    slow.go.set()
    with pytest.raises(type(error)):
        first.result(10)
    assert second.result(10) == "value"
    assert memo.get("a", slow) == "value"


def test_who_waits_keeps_its_own_deadline(pool: ThreadPoolExecutor) -> None:
    memo, slow, left = Memo(), Slow("value"), Event()

    def abandoned() -> Any:
        with deadline.limit(60.0, left):
            return memo.get("a", slow)

    first = pool.submit(memo.get, "a", slow)
    assert slow.begun.wait(10)
    second = waiting(abandoned, pool)
    left.set()
    with pytest.raises(deadline.Abandoned):
        second.result(10)
    slow.go.set()
    assert first.result(10) == "value"


def test_waiting_for_another_is_waiting_in_the_queue(pool: ThreadPoolExecutor) -> None:
    memo, slow, record = Memo(), Slow("value"), Record()

    def recorded() -> Any:
        with recording(record):
            return memo.get("a", slow)

    pool.submit(memo.get, "a", slow)
    assert slow.begun.wait(10)
    second = waiting(recorded, pool)
    slow.go.set()
    second.result(10)
    assert [interval.stage for interval in record.intervals] == ["queue"]
