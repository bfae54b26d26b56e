from __future__ import annotations

import time
from threading import Event

import pytest

from service import deadline
from service.stages import STAGES, Record, recording, stage


def test_nothing_is_noted_where_nobody_asks() -> None:
    with stage("read"):
        pass


def test_times_are_by_stage_and_in_order() -> None:
    record = Record()
    with recording(record):
        with stage("write"):
            time.sleep(0.01)
        for _ in range(2):
            with stage("read"):
                time.sleep(0.02)
    assert list(record.seconds) == ["read", "write"]
    assert 0.04 <= record.seconds["read"] < 0.5
    assert 0.01 <= record.seconds["write"] < 0.5
    assert abs(record.intervals[0].start - time.time()) < 5
    with stage("read"):
        pass
    assert len(record.intervals) == 3


def test_a_stage_within_another_counts_once() -> None:
    record = Record()
    start = time.perf_counter()
    with recording(record), stage("encode"):
        time.sleep(0.01)
        with stage("refine"):
            time.sleep(0.05)
        time.sleep(0.01)
    whole = time.perf_counter() - start
    assert record.seconds["refine"] >= 0.05
    assert record.seconds["encode"] >= 0.02
    assert sum(record.seconds.values()) <= whole
    refine, encode = record.intervals
    assert refine.whole == refine.seconds
    assert encode.whole == pytest.approx(encode.seconds + refine.whole)


def test_a_stage_that_fails_is_noted_all_the_same() -> None:
    record = Record()
    with recording(record), pytest.raises(ValueError, match="bad"), stage("bind"):
        raise ValueError("bad")
    assert list(record.seconds) == ["bind"]


def test_waiting_is_added_by_whoever_knows_of_it() -> None:
    record = Record()
    record.add("queue", 1.0, 2.0)
    assert record.seconds == {"queue": 2.0}
    assert STAGES[0] == "queue"


def test_no_stage_begins_for_an_answer_that_nobody_waits_for() -> None:
    abandoned = Event()
    record = Record()
    with deadline.limit(60, abandoned), recording(record):
        abandoned.set()
        with pytest.raises(deadline.Abandoned), stage("read"):
            pytest.fail("it began")
    assert not record.intervals
