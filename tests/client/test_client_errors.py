from __future__ import annotations

import pickle

import httpx
import pytest
from client_app import Script, refused

from service.client import (
    AnswerMalformed,
    CategoryUnknown,
    ConstraintsConflict,
    NotFound,
    ParameterUnknown,
    ProblemError,
    ShapeClient,
    Unprocessable,
    UnsupportedMedia,
    set_to,
)
from service.client.errors import problem


@pytest.fixture
def client(service_client: httpx.Client) -> ShapeClient:
    return ShapeClient(http=service_client)


def test_codes_have_classes(client: ShapeClient, chair_glb: bytes) -> None:
    with pytest.raises(CategoryUnknown) as caught:
        client.category("sofa")
    assert str(caught.value).startswith("unknown_category: ")
    assert f"[{caught.value.trace_id}]" in str(caught.value)
    with pytest.raises(ParameterUnknown):
        client.edit(chair_glb, {"seat_with": 1}, category="chair")
    with pytest.raises(UnsupportedMedia):
        client.infer(b"nothing")


def test_conflicts_are_told(client: ShapeClient, chair_glb: bytes) -> None:
    wanted = {"seat_top_height": set_to(0.4), "leg_height": set_to(0.9)}
    with pytest.raises(ConstraintsConflict) as caught:
        client.edit(chair_glb, category="chair", constraints=wanted)
    assert {conflict.name for conflict in caught.value.conflicts} == set(wanted)


def test_any_form_can_be_posted(client: ShapeClient) -> None:
    with pytest.raises(Unprocessable) as caught:
        client.post("/infer", [("up", "+y"), ("up", "+z")])
    assert caught.value.code == "field_repeated"
    with pytest.raises(NotFound):
        client.post("/nowhere")
    assert client.post("/livez", method="GET").content == b'{"status":"alive"}'


def test_an_unknown_code_has_the_class_of_its_status() -> None:
    with pytest.raises(ProblemError) as caught:
        Script(refused(418, "teapot")).client().alive()
    assert type(caught.value) is ProblemError
    assert str(caught.value) == "teapot: It is so. (Do else.) [4b]"


def test_what_is_no_problem_document_is_malformed() -> None:
    with pytest.raises(AnswerMalformed, match="<html>") as caught:
        Script(httpx.Response(403, html="<html>Blocked</html>")).client().alive()
    assert caught.value.status == 403
    assert problem({"code": "x", "conflicts": 3}, 422) is None


def test_they_can_cross_processes() -> None:
    error = problem({"code": "mesh_empty", "detail": "d", "more": 1}, 422, 2.0)
    assert error is not None
    copy = pickle.loads(pickle.dumps(error))
    assert (copy.code, copy.members, copy.retry_after) == ("mesh_empty", {"more": 1}, 2.0)


def test_numbers_must_be_finite(client: ShapeClient) -> None:
    with pytest.raises(ValueError, match="nan is not finite"):
        client.edit(b"", {"seat_width": float("nan")})
