from __future__ import annotations

from collections.abc import Callable
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

from service.api.keys import Entry, digest_of, new_key

MESH = ("chair.obj", b"abc", "model/obj")
PAGE = "https://shapes.example"
KEY = new_key()
READABLE = {
    "content-disposition", "etag", "retry-after", "server-timing", "shape-parameters", "trace-id",
}  # fmt: skip


@pytest.fixture
def make(pretend_app: Callable[..., FastAPI], serve: Any) -> Callable[..., httpx.Client]:
    return lambda **settings: serve(pretend_app(**settings))


def preflight(
    client: httpx.Client, origin: str = PAGE, method: str = "POST", headers: str = "authorization"
) -> httpx.Response:
    asked = {
        "Origin": origin,
        "Access-Control-Request-Method": method,
        "Access-Control-Request-Headers": headers,
    }
    return client.options("/infer", headers=asked)


def test_by_default_no_page_of_another_origin_gets_an_answer(
    client: httpx.Client, problem: Any
) -> None:
    problem(preflight(client), 405, "method_not_allowed")
    response = client.get("/categories", headers={"Origin": PAGE})
    assert not [name for name in response.headers if name.startswith("access-control")]


def test_a_page_that_is_let_in(make: Callable[..., httpx.Client]) -> None:
    client = make(cors_origins=f"{PAGE},http://localhost:5173")
    response = client.post("/infer", files={"mesh": MESH}, headers={"Origin": PAGE})
    assert response.status_code == 200
    assert response.headers["access-control-allow-origin"] == PAGE
    assert "Origin" in response.headers["vary"]
    exposed = response.headers["access-control-expose-headers"].lower().split(", ")
    assert set(exposed) >= READABLE
    assert "access-control-allow-credentials" not in response.headers


@pytest.mark.parametrize("origin", ["https://else.example", PAGE + ".evil", "null", PAGE + ":8443"])
def test_another_page_is_not(make: Callable[..., httpx.Client], problem: Any, origin: str) -> None:
    client = make(cors_origins=PAGE)
    response = client.get("/categories", headers={"Origin": origin})
    assert "access-control-allow-origin" not in response.headers
    refused = preflight(client, origin)
    document = problem(refused, 400, "cors_refused")
    assert "origin" in document.detail
    assert "access-control-allow-origin" not in refused.headers


def test_all_pages_can_be_let_in(make: Callable[..., httpx.Client]) -> None:
    client = make(cors_origins="*")
    for response in (preflight(client), client.get("/categories", headers={"Origin": PAGE})):
        assert response.status_code == 200
        assert response.headers["access-control-allow-origin"] == "*"
        assert "access-control-allow-credentials" not in response.headers


def test_a_preflight_tells_what_may_be_sent(make: Callable[..., httpx.Client]) -> None:
    sent = "authorization,x-api-key,if-none-match,traceparent,tracestate,content-type"
    response = preflight(make(cors_origins=PAGE), headers=sent)
    assert response.status_code == 200
    assert response.headers["access-control-allow-origin"] == PAGE
    assert response.headers["access-control-allow-methods"] == "DELETE, GET, HEAD, POST"
    assert int(response.headers["access-control-max-age"]) >= 600
    assert response.headers["trace-id"]
    assert response.headers["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize(("method", "headers"), [("PUT", ""), ("POST", "x-other")])
def test_a_preflight_of_what_is_not_let_through(
    make: Callable[..., httpx.Client], problem: Any, method: str, headers: str
) -> None:
    problem(preflight(make(cors_origins=PAGE), PAGE, method, headers), 400, "cors_refused")


def test_a_preflight_needs_no_key_but_the_call_does(
    make: Callable[..., httpx.Client], problem: Any
) -> None:
    client = make(cors_origins=PAGE, api_keys=str(Entry("ann", digest_of(KEY))))
    assert preflight(client).status_code == 200
    # An OPTIONS that is no preflight is a call like others.
    problem(client.options("/infer"), 401, "key_missing")
    problem(client.options("/infer", headers={"Origin": PAGE}), 401, "key_missing")
    key = {"Authorization": f"Bearer {KEY}", "Origin": PAGE}
    assert client.post("/infer", files={"mesh": MESH}, headers=key).status_code == 200


def test_a_page_can_read_every_error(
    pretend_app: Callable[..., FastAPI], serve: Any, pretend: Any, problem: Any
) -> None:
    entry = str(Entry("ann", digest_of(KEY)))
    app = pretend_app(cors_origins=PAGE, max_upload_bytes=2000, api_keys=entry)
    client = serve(app)

    def fail() -> None:
        raise ZeroDivisionError

    pretend.work = fail
    key = {"Authorization": f"Bearer {KEY}"}
    large = {"mesh": ("a.obj", bytes(3000))}
    client.headers["Origin"] = PAGE
    answers = [
        (client.post("/infer", files={"mesh": MESH}), 401, "key_missing"),
        (client.post("/infer", files=large, headers=key), 413, "body_too_large"),
        (client.post("/infer", files={"mesh": MESH}, headers=key), 500, "internal_error"),
        (client.get("/nowhere", headers=key), 404, "not_found"),
        (client.put("/infer", headers=key), 405, "method_not_allowed"),
    ]
    app.state.context.admission.places = 0
    answers.append((client.post("/infer", files={"mesh": MESH}, headers=key), 429, "overloaded"))
    for response, status, code in answers:
        problem(response, status, code)
        assert response.headers["access-control-allow-origin"] == PAGE, code
        assert "Origin" in response.headers["vary"]
