from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest

from service.store import patience as patience_module
from service.store.patience import Patience, Unreachable


def test_a_result_and_an_error_come_through() -> None:
    patience = Patience(seconds=10, at_once=1, pause=0)
    assert patience.run(divmod, 7, 2) == (3, 1)
    with pytest.raises(ZeroDivisionError):
        patience.run(divmod, 7, 0)
    assert patience.run(divmod, 7, 2) == (3, 1)


def test_what_failed_is_left_alone_for_a_while() -> None:
    patience = Patience(seconds=10, at_once=1, pause=60)
    with pytest.raises(ZeroDivisionError):
        patience.run(divmod, 7, 0)
    with pytest.raises(Unreachable, match="a moment ago"):
        patience.run(divmod, 7, 2)


def test_one_call_at_a_time_tries_what_failed() -> None:
    patience = Patience(seconds=20, at_once=4, pause=0)
    with pytest.raises(ZeroDivisionError):
        patience.run(divmod, 7, 0)
    entered, release = threading.Event(), threading.Event()

    def slow() -> str:
        entered.set()
        release.wait(20)
        return "well"

    with ThreadPoolExecutor(1) as pool:
        trial = pool.submit(patience.run, slow)
        assert entered.wait(20)
        with pytest.raises(Unreachable, match="a moment ago"):
            patience.run(divmod, 7, 2)
        release.set()
        assert trial.result() == "well"
    assert patience.run(divmod, 7, 2) == (3, 1)


def test_each_trial_that_fails_doubles_the_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 1000.0
    monkeypatch.setattr(patience_module, "time", SimpleNamespace(monotonic=lambda: now))
    patience = Patience(seconds=20, at_once=1, pause=5)
    for pause in (5, 10, 20, 40, 60, 60):
        with pytest.raises(ZeroDivisionError):
            patience.run(divmod, 7, 0)
        now += pause - 0.1
        with pytest.raises(Unreachable):
            patience.run(divmod, 7, 2)
        now += 0.1
    assert patience.run(divmod, 7, 2) == (3, 1)
    with pytest.raises(ZeroDivisionError):
        patience.run(divmod, 7, 0)
    now += 5
    assert patience.run(divmod, 7, 2) == (3, 1)


def test_what_is_missing_is_an_answer() -> None:
    patience = Patience(seconds=10, at_once=1, pause=60)

    def missing() -> None:
        raise FileNotFoundError

    for _ in range(2):
        with pytest.raises(FileNotFoundError):
            patience.run(missing)


def test_what_hangs_is_given_up_and_takes_no_more_than_its_turns() -> None:
    release = threading.Event()
    calls = []

    def hang() -> None:
        calls.append(1)
        release.wait(60)

    patience = Patience(seconds=0.1, at_once=2, pause=0)
    before = time.monotonic()
    for _ in range(4):
        with pytest.raises(Unreachable, match=r"within 0\.1 s"):
            patience.run(hang)
    assert time.monotonic() - before < 30
    assert len(calls) == 2
    release.set()
    patience = Patience(seconds=10, at_once=2, pause=0)
    assert patience.run(divmod, 7, 2) == (3, 1)
