from __future__ import annotations

import logging
from concurrent.futures import ThreadPoolExecutor

import pytest

from service.store import tally
from service.store.tally import Complaints, Tally


def test_no_count_is_lost_between_threads() -> None:
    counts = Tally()
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda _: counts.add("hits"), range(4000)))
    assert counts.hits == 4000
    assert counts == Tally(hits=4000)


def test_a_complaint_is_made_once_in_a_while(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    complaints = Complaints("disk")
    with caplog.at_level(logging.WARNING):
        for _ in range(4):
            complaints.say("can't write", OSError("full"))
        monkeypatch.setattr(tally.time, "monotonic", lambda: float("inf"))
        complaints.say("can't write", OSError("full"))
    first, second = (record.getMessage() for record in caplog.records)
    assert first == "the disk store can't write: OSError: full"
    assert second == "the disk store can't write: OSError: full (3 more since the last time)"
