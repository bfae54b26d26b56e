from __future__ import annotations

import json

import pytest
from starlette.requests import Request
from starlette.responses import Response

from service.api.report_response import report_response

HEADERS = {"Cache-Control": "private, no-cache", "Vary": "Accept"}


def respond(*warnings: str, held: str = "", report: dict[str, object] | None = None) -> Response:
    request = Request({"type": "http", "headers": [(b"if-none-match", held.encode())]})
    report = {"category": "stool"} if report is None else report
    return report_response(request, report, list(warnings), "ab", HEADERS)


def test_a_report_comes_with_its_tag() -> None:
    response = respond()
    assert json.loads(response.body) == {"category": "stool"}
    assert response.headers["etag"] == 'W/"ab"'
    assert response.headers["cache-control"] == "private, no-cache"
    assert response.headers["vary"] == "Accept"


@pytest.mark.parametrize("held", ['"ab"', 'W/"ab"', "*"])
def test_who_holds_it_gets_304(held: str) -> None:
    response = respond(held=held)
    assert (response.status_code, response.body) == (304, b"")
    assert response.headers["etag"] == 'W/"ab"'


def test_warnings_of_this_moment_are_not_to_be_held_on_to() -> None:
    response = respond("full", held="*", report={"warnings": ["a warning"]})
    assert json.loads(response.body) == {"warnings": ["a warning", "full"]}
    assert response.status_code == 200
    assert "etag" not in response.headers
    assert response.headers["cache-control"] == "no-store"
    assert json.loads(respond("full").body)["warnings"] == ["full"]
