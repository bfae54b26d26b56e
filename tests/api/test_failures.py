from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from starlette.responses import StreamingResponse


@pytest.fixture
def failing(pretend_app: Callable[..., FastAPI], serve: Any) -> httpx.Client:
    app = pretend_app()

    @app.get("/fails")
    async def fails() -> None:
        raise RuntimeError("a secret of the inside")

    def pieces() -> Iterator[bytes]:
        yield b"the beginning"
        raise RuntimeError("amid the answer")

    @app.get("/breaks")
    async def breaks() -> StreamingResponse:
        return StreamingResponse(pieces())

    return serve(app)


def test_it_is_logged_and_answered_with_its_trace(
    failing: httpx.Client, problem: Any, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    response = failing.get("/fails")
    document = problem(response, 500, "internal_error")
    assert "secret" not in response.text
    record = next(record for record in caplog.records if record.exc_info)
    assert document.trace_id in record.getMessage()
    assert "secret" in str(record.exc_info[1])
    assert failing.get("/livez").status_code == 200


def test_an_answer_that_has_begun_is_cut_off(failing: httpx.Client) -> None:
    with pytest.raises(httpx.RemoteProtocolError):
        failing.get("/breaks")
    assert failing.get("/livez").status_code == 200
