"""Every operation of the service's document is called through both clients, and succeeds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from fastapi.routing import iter_route_contexts
from provoke import BOX
from provoke_blocking import blocking

from service.api.routes import Routes
from service.client import Job, ShapeClient
from service.main import create_app
from service.settings import Settings

Operation = tuple[str, str]

WIDER = [{"width": {"scale": 1.2}}]


def by_id(client: ShapeClient) -> Any:
    return client.mesh(client.infer(BOX).mesh_id)


def submitted(client: ShapeClient) -> Job:
    return client.submit_edit(BOX, WIDER)


def followed(client: ShapeClient) -> Any:
    """All that is told of a job, up to its end."""
    told = list(client.events(submitted(client)))
    assert told[-1].job.status == "succeeded"
    return told


def fetched(client: ShapeClient) -> Any:
    return client.result(client.wait(submitted(client), timeout=20)).manifest


CALLS: dict[Operation, Callable[[ShapeClient], Any]] = {
    ("GET", "/categories"): lambda client: client.categories(),
    ("GET", "/categories/{name}"): lambda client: client.category("debug"),
    ("DELETE", "/jobs/{job_id}"): lambda client: client.cancel(submitted(client)) or True,
    ("GET", "/jobs"): lambda client: [submitted(client), *client.jobs()],
    ("GET", "/jobs/{job_id}"): lambda client: client.job(submitted(client)),
    ("GET", "/jobs/{job_id}/events"): followed,
    ("GET", "/jobs/{job_id}/result"): fetched,
    ("GET", "/livez"): lambda client: client.alive(),
    ("GET", "/meshes/{mesh_id}"): by_id,
    ("GET", "/metrics"): lambda client: client.post("/metrics", method="GET"),
    ("GET", "/readyz"): lambda client: client.ready(),
    ("POST", "/augment"): lambda client: client.augment(BOX, count=2).manifest,
    ("POST", "/edit"): lambda client: client.edit(BOX, {"width": {"scale": 1.2}}),
    ("POST", "/infer"): lambda client: client.infer(BOX),
    ("POST", "/sliders"): lambda client: client.sliders(BOX),
    ("POST", "/template"): lambda client: client.template(BOX),
    ("POST", "/transfer"): lambda client: client.transfer(BOX, BOX),
}
"""By method and path as the document has them."""

PAGES: dict[str, str] = {
    "/": "/",
    "/docs": "/docs",
    "/openapi.json": "/openapi.json",
    "/web/{path:path}": "/web/icon.svg",
}
"""Paths that the document leaves out, with one of each to ask for."""


@pytest.fixture(scope="module")
def app() -> FastAPI:
    """A service that knows boxes alone."""
    return create_app(Settings(categories=("debug",), workers=1))


@pytest.fixture(scope="module")
def http(app: FastAPI, serving: Any) -> Iterator[httpx.Client]:
    with serving(app) as client:
        yield client


@pytest.fixture
def answered() -> list[httpx.Response]:
    """What the client is answered."""
    return []


@pytest.fixture(params=["blocking", "asynchronous"])
def client(
    http: httpx.Client, answered: list[httpx.Response], request: pytest.FixtureRequest
) -> Iterator[Any]:
    """Either client."""
    url = str(http.base_url)
    if request.param == "asynchronous":
        with blocking(url, answered.append) as waiting:
            yield waiting
        return
    with httpx.Client(event_hooks={"response": [answered.append]}, trust_env=False) as noting:
        yield ShapeClient(url, http=noting)


def operations(app: FastAPI) -> set[Operation]:
    """All that the document has."""
    paths = app.openapi()["paths"]
    return {(method.upper(), path) for path, entry in paths.items() for method in entry}


def test_there_is_a_call_for_each_operation_and_no_other(app: FastAPI) -> None:
    assert CALLS.keys() == operations(app)


def test_there_is_a_call_for_each_page_and_no_other(app: FastAPI) -> None:
    routes = [context.original_route for context in iter_route_contexts(app.routes)]
    hidden = {route.path for route in routes if not getattr(route, "include_in_schema", True)}
    assert hidden == PAGES.keys()


@pytest.mark.parametrize(("method", "path"), sorted(CALLS))
def test_an_operation(
    app: FastAPI,
    client: ShapeClient,
    answered: list[httpx.Response],
    method: str,
    path: str,
) -> None:
    assert CALLS[method, path](client)
    template = Routes(app.routes).template(answered[-1].request.url.path)
    assert (answered[-1].request.method, template) == (method, path)
    assert all(answer.is_success for answer in answered)


@pytest.mark.parametrize("path", PAGES.values())
def test_a_page(client: ShapeClient, path: str) -> None:
    assert client.post(path, method="GET").content
