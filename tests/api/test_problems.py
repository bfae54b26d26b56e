from __future__ import annotations

import json
from contextlib import closing
from http.client import HTTPConnection
from typing import Any

import httpx
import pytest

from service import errors

CASES = [
    (errors.UnsupportedFormat, 415, "Unsupported Media Type"),
    (errors.InvalidMesh, 422, "Unprocessable Content"),
    (errors.TooLarge, 413, "Content Too Large"),
    (errors.TooComplex, 422, "Unprocessable Content"),
    (errors.InvalidRequest, 422, "Unprocessable Content"),
    (errors.NotFound, 404, "Not Found"),
    (errors.Conflict, 409, "Conflict"),
    (errors.Crowded, 429, "Too Many Requests"),
    (errors.Overloaded, 503, "Service Unavailable"),
    (errors.ModelFault, 503, "Service Unavailable"),
]


@pytest.mark.parametrize(("kind", "status", "title"), CASES)
def test_each_error_has_its_status(
    client: httpx.Client,
    pretend: Any,
    problem: Any,
    kind: type[errors.ShapeError],
    status: int,
    title: str,
) -> None:
    def fail() -> None:
        raise kind("some_code", "what was found", "what to do")

    pretend.work = fail
    document = problem(
        client.post("/infer", files={"mesh": ("a.obj", b"abc")}), status, "some_code"
    )
    assert (document.detail, document.suggestion) == ("what was found", "what to do")
    assert (document.type, document.title) == ("about:blank", title)


def test_members_of_an_error_are_members_of_the_document(
    client: httpx.Client, pretend: Any, problem: Any
) -> None:
    conflict = {"name": "a", "asked": {"max": 1.0}, "nearest": 2.0, "by": 1.0, "unit": "m"}

    def fail() -> None:
        raise errors.InvalidRequest("some_code", "found", "to do", {"conflicts": [conflict]})

    pretend.work = fail
    response = client.post("/infer", files={"mesh": ("a.obj", b"abc")})
    document = problem(response, 422, "some_code")
    assert response.json()["conflicts"] == [conflict]
    assert document.conflicts[0].asked.max == 1.0


def test_every_error_class_has_a_status() -> None:
    assert set(errors.ShapeError.__subclasses__()) == {kind for kind, _, _ in CASES}


def test_a_path_that_is_not_there(client: httpx.Client, problem: Any) -> None:
    assert "/nowhere" in problem(client.get("/nowhere"), 404, "not_found").detail


@pytest.mark.parametrize(
    ("method", "path", "allowed"),
    [
        ("GET", "/infer", "POST"),
        ("PUT", "/edit", "POST"),
        ("OPTIONS", "/sliders", "POST"),
        ("DELETE", "/meshes/x", "GET, HEAD"),
        ("POST", "/livez", "GET, HEAD"),
        ("POST", "/", "GET, HEAD"),
        ("FOO", "/docs", "GET, HEAD"),
        ("OPTIONS", "/web/js/app.js", "GET, HEAD"),
        ("TRACE", "/categories", "GET, HEAD"),
    ],
)
def test_a_method_that_is_not_allowed(
    client: httpx.Client, problem: Any, method: str, path: str, allowed: str
) -> None:
    response = client.request(method, path)
    problem(response, 405, "method_not_allowed")
    assert response.headers["allow"] == allowed


def test_a_head_of_what_is_only_posted_to(client: httpx.Client) -> None:
    response = client.head("/infer")
    assert (response.status_code, response.headers["allow"]) == (405, "POST")
    assert response.headers["content-type"] == "application/problem+json"
    assert response.content == b""


@pytest.mark.parametrize(
    ("content_type", "body"),
    [
        ("multipart/form-data", b"abc"),
        ("multipart/form-data; boundary=", b"abc"),
        ("multipart/form-data; boundary=xx", b"abc"),
        ("multipart/form-data; boundary=xx", b"--xx\r\nContent-Disposition: form-data\r\n\r\n1"),
    ],
)
def test_a_malformed_multipart_body(
    client: httpx.Client, problem: Any, content_type: str, body: bytes
) -> None:
    response = client.post("/infer", content=body, headers={"content-type": content_type})
    problem(response, 400, "body_malformed")


@pytest.mark.parametrize(
    ("target", "status"),
    [
        ("/%ff%fe", 404),
        ("/%00", 404),
        ("/%f0%9f%aa%91", 404),
        ("/infer%0d%0aX-Injected:%20yes", 404),
        ("/categories/%2e%2e%2fsecret", 404),
        ("/categories/%ed%a0%80", 404),
        ("/meshes/..%2f..%2fetc%2fpasswd", 404),
        ("/meshes/%00", 404),
        ("/" + "a" * 4000, 404),
        ("/infer/", 404),
        ("//infer", 404),
        ("/infer?" + "q=1&" * 1000, 405),
        ("/livez;a=b", 404),
        ("*", 404),
        ("http://elsewhere.example/nowhere", 404),
    ],
)
def test_odd_targets(client: httpx.Client, target: str, status: int) -> None:
    """Sent as they stand, by what does not tidy them up."""
    connection = HTTPConnection(client.base_url.host, client.base_url.port, timeout=10)
    with closing(connection):
        connection.request("GET", target)
        response = connection.getresponse()
        document = json.load(response)
    assert (response.status, document["status"]) == (status, status)
    assert response.headers.get_content_type() == "application/problem+json"
    assert "x-injected" not in response.headers
    assert "location" not in response.headers
    assert document["detail"].isprintable()
    assert len(json.dumps(document)) < 2000
