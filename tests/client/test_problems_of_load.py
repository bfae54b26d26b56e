"""More than the service takes at once, or in time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from provoke import BOX, client_of, provokes, refused

from service import pipeline
from service.client import ShapeClient
from service.main import create_app
from service.settings import Settings

Make = Callable[..., ShapeClient]


@pytest.fixture
def tight(serve: Any) -> Make:
    """Makes a service of one worker, ready to work; a client of it."""

    def make(**settings: Any) -> ShapeClient:
        app = create_app(Settings(**{"categories": ("debug",), "workers": 1, **settings}))
        client = client_of(serve(app))
        assert client.categories()
        return client

    return make


def slowed(monkeypatch: pytest.MonkeyPatch, work: Callable[[], Any]) -> None:
    """Have the pipeline do something else first; it is the real one otherwise."""
    infer = pipeline.infer

    def slow(*arguments: Any) -> Any:
        work()
        return infer(*arguments)

    monkeypatch.setattr(pipeline, "infer", slow)


@provokes(overloaded=429)
def test_more_than_there_are_places(tight: Make, monkeypatch: pytest.MonkeyPatch) -> Any:
    client = tight(queue=0)
    entered, release = threading.Event(), threading.Event()

    def wait() -> None:
        entered.set()
        assert release.wait(20)

    slowed(monkeypatch, wait)
    with ThreadPoolExecutor(1) as pool:
        first = pool.submit(client.infer, BOX)
        assert entered.wait(20)
        try:
            refusal = refused(lambda: client.infer(BOX))
        finally:
            release.set()
        assert first.result().category == "debug"
    assert refusal.retry_after >= 1
    return refusal


def spin(seconds: float) -> None:
    """Work, in time that this thread has of a CPU."""
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        pass


@provokes(too_complex=422, deadline_exceeded=503)
def test_work_that_takes_longer_than_it_may(
    tight: Make, monkeypatch: pytest.MonkeyPatch, code: str
) -> Any:
    client = tight(deadline_seconds=0.2)
    work = spin if code == "too_complex" else time.sleep
    slowed(monkeypatch, lambda: work(0.4))
    return refused(lambda: client.infer(BOX, units="cm"))


@provokes(internal_error=500)
def test_what_nothing_foresaw(tight: Make, monkeypatch: pytest.MonkeyPatch) -> Any:
    client = tight()

    def fail() -> None:
        raise RuntimeError("a secret of the inside")

    slowed(monkeypatch, fail)
    refusal = refused(lambda: client.infer(BOX))
    assert "secret" not in str(refusal)
    return refusal


@provokes(body_too_large=413)
def test_a_body_over_the_limit(tight: Make) -> Any:
    client = tight(max_upload_bytes=len(BOX) + 2000)
    return refused(lambda: client.infer(BOX + bytes(2000)))
