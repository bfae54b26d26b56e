from __future__ import annotations

import re

import pytest

from service.api.trace import request_id, trace_id

TRACE = "4bf92f3577b34da6a3ce929d0e0e4736"
PARENT = "00f067aa0ba902b7"


@pytest.mark.parametrize(
    "traceparent",
    [f"00-{TRACE}-{PARENT}-01", f" 00-{TRACE}-{PARENT}-00 ", f"01-{TRACE}-{PARENT}-01-more"],
)
def test_a_valid_traceparent_gives_the_id(traceparent: str) -> None:
    assert trace_id(traceparent) == TRACE


@pytest.mark.parametrize(
    "traceparent",
    [
        None,
        "",
        TRACE,
        f"00-{TRACE.upper()}-{PARENT}-01",
        f"00-{'0' * 32}-{PARENT}-01",
        f"00-{TRACE}-{'0' * 16}-01",
        f"00-{TRACE}-{PARENT}-01-more",
        f"ff-{TRACE}-{PARENT}-01",
        f"00-{TRACE}-{PARENT}",
        f"00-{TRACE}\r\nX: y-{PARENT}-01",
    ],
)
def test_an_invalid_one_gives_a_fresh_id(traceparent: str | None) -> None:
    first, second = trace_id(traceparent), trace_id(traceparent)
    assert re.fullmatch("[0-9a-f]{32}", first)
    assert first != second
    assert first != TRACE


@pytest.mark.parametrize("given", ["7", "b5b7c3f0-61a1-4b8e-9f6e-0a4f8e7a0f11", "1-5759e988-bd8@x"])
def test_a_requests_own_id_is_kept(given: str) -> None:
    assert request_id(given) == given


@pytest.mark.parametrize("given", [None, "", "a b", "a\nb", "a" * 129, "-a", '"a"', "ä"])
def test_one_that_could_do_harm_is_not(given: str | None) -> None:
    assert re.fullmatch("[0-9a-f]{32}", request_id(given))
    assert request_id(given) != request_id(given)
