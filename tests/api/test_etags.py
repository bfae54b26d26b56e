from __future__ import annotations

from collections.abc import Callable
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from starlette.requests import Request

from service import pipeline
from service.api import etags
from service.api.forms import EditForm, InferForm
from service.requests import Upload
from service.store.memory import OVERHEAD

MESH = ("a.obj", b"abc", "model/obj")
EDITS = {"edits": '{"seat_width": 0.5}'}
REPORT = {"accept": "application/json"}


class Stool:
    fingerprint = "00"


def asking(if_none_match: str | None = None, path: str = "/infer", accept: str = "*/*") -> Request:
    headers = [(b"accept", accept.encode())]
    if if_none_match is not None:
        headers.append((b"if-none-match", if_none_match.encode("latin-1")))
    return Request({"type": "http", "path": path, "headers": headers})


@pytest.mark.parametrize(
    ("header", "insides"),
    [
        ('"ab"', ["ab"]),
        ('W/"ab"', ["ab"]),
        ('"ab", W/"c,d" ,"e"', ["ab", "c,d", "e"]),
        ("*", []),
        ("ab", []),
        ("", []),
        (None, []),
    ],
)
def test_what_a_client_holds(header: str | None, insides: list[str]) -> None:
    assert etags.named(asking(header)) == insides


@pytest.mark.parametrize(
    ("header", "held"),
    [('"ab"', True), ('W/"ab"', True), ("*", True), ('"a"', False), ("ab", False), (None, False)],
)
@pytest.mark.parametrize("tag", [etags.weak("ab"), etags.strong("ab")])
def test_tags_are_compared_weakly(header: str | None, held: bool, tag: str) -> None:
    assert etags.held(asking(header), tag) is held


UPLOAD = Upload(b"abc", "a.obj", "model/obj")


def validator(**changed: Any) -> str:
    given = {
        "request": asking(),
        "uploads": (UPLOAD,),
        "form": InferForm(),
        "models": {"stool": Stool()},
        **changed,
    }
    return etags.validator(**given)


@pytest.mark.parametrize(
    "changed",
    [
        {"request": asking(path="/edit")},
        {"request": asking(accept="application/json")},
        {"uploads": (Upload(b"abd", "a.obj", "model/obj"),)},
        {"uploads": (Upload(b"abc", "b.obj", "model/obj"),)},
        {"uploads": (Upload(b"abc", "a.obj", None),)},
        {"uploads": (UPLOAD, UPLOAD)},
        {"form": InferForm(units="cm")},
        {"form": InferForm(refine=False)},
        {"form": EditForm(edits="{}")},
        {"models": {}},
        {"models": {"chair": Stool()}},
    ],
)
def test_all_that_an_answer_depends_on_is_in_the_tag(changed: dict[str, Any]) -> None:
    assert validator(**changed) != validator()


def test_models_and_the_build_are_in_the_tag(monkeypatch: pytest.MonkeyPatch) -> None:
    before = validator()
    with monkeypatch.context() as patch:
        patch.setattr(Stool, "fingerprint", "01")
        assert validator() != before
    monkeypatch.setattr(etags, "build", lambda: "another")
    assert validator() != before


def test_how_the_mesh_came_and_what_is_held_is_not_in_the_tag() -> None:
    assert validator(form=InferForm(mesh_id="sha256-0")) == validator()
    assert validator(request=asking('"ab"')) == validator()


@pytest.mark.parametrize(
    ("path", "fields", "headers"),
    [("/infer", {}, {}), ("/edit", EDITS, {}), ("/edit", EDITS, REPORT)],
)
def test_nothing_is_computed_for_who_holds_the_answer(
    client: httpx.Client,
    pretend: Any,
    path: str,
    fields: dict[str, str],
    headers: dict[str, str],
) -> None:
    def send(tag: str, **changed: Any) -> httpx.Response:
        form: dict[str, Any] = {"files": {"mesh": MESH}, "data": fields, **changed}
        return client.post(path, headers={**headers, "If-None-Match": tag}, **form)

    first = client.post(path, files={"mesh": MESH}, data=fields, headers=headers)
    tag = first.headers["etag"]
    assert tag.startswith('W/"')
    assert len(pretend.calls) == 1
    again = send(f'"other", {tag}')
    assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", tag)
    for name in ("cache-control", "vary"):
        assert again.headers.get(name) == first.headers.get(name)
    assert len(pretend.calls) == 1
    # By its id as well, which is the same mesh.
    mesh_id = client.post("/infer", files={"mesh": MESH}).json()["mesh_id"]
    assert send(tag, files=None, data={**fields, "mesh_id": mesh_id}).status_code == 304
    # Another mesh, another option, or another tag is another answer.
    assert send(tag, files={"mesh": ("a.obj", b"abd", "model/obj")}).status_code == 200
    assert send(tag, data={**fields, "units": "cm"}).status_code == 200
    assert send('"other"').status_code == 200
    calls = len(pretend.calls)
    # Whether there is any answer is known once it is computed.
    assert send("*").status_code == 304
    assert len(pretend.calls) == calls + 1


def test_an_unknown_id_is_unknown_whatever_the_client_holds(
    client: httpx.Client, problem: Any
) -> None:
    form = {"mesh_id": "sha256-" + "0" * 64}
    problem(
        client.post("/infer", data=form, headers={"if-none-match": "*"}), 404, "mesh_id_unknown"
    )


def test_a_held_report_is_good_while_its_mesh_is_kept(
    pretend_app: Callable[..., FastAPI], pretend: Any, serve: Any
) -> None:
    # The source and its edit have just room.
    client = serve(pretend_app(mesh_cache_bytes=2 * OVERHEAD + 20))
    answer = client.post("/edit", files={"mesh": MESH}, data=EDITS, headers=REPORT)
    headers = {**REPORT, "if-none-match": answer.headers["etag"]}
    again = {"files": {"mesh": MESH}, "data": EDITS, "headers": headers}
    assert client.post("/edit", **again).status_code == 304
    client.post("/infer", files={"mesh": ("b.obj", b"another")})
    client.post("/infer", files={"mesh": ("c.obj", b"a third")})
    assert client.get(f"/meshes/{answer.json()['mesh_id']}").status_code == 404
    calls = len(pretend.calls)
    assert client.post("/edit", **again).status_code == 304
    assert len(pretend.calls) == calls + 1
    for name in ("mesh_id", "source_mesh_id"):
        assert client.get(f"/meshes/{answer.json()[name]}").status_code == 200


@pytest.mark.parametrize("call", ["sliders", "template"])
def test_sliders_are_not_made_for_who_holds_them(
    pretend_app: Callable[..., FastAPI], monkeypatch: pytest.MonkeyPatch, serve: Any, call: str
) -> None:
    calls: list[Any] = []
    monkeypatch.setattr(pipeline, call, lambda *given: calls.append(given) or b"glb")
    client = serve(pretend_app())
    form = {"files": {"mesh": MESH}, "data": {"parameters": "seat_width"}}
    answer = client.post(f"/{call}", **form)
    assert answer.content == b"glb"
    headers = {"if-none-match": answer.headers["etag"]}
    again = client.post(f"/{call}", headers=headers, **form)
    assert (again.status_code, len(calls)) == (304, 1)
    other = {**form, "data": {"parameters": "seat_depth"}}
    assert client.post(f"/{call}", headers=headers, **other).status_code == 200


def test_categories_are_tagged_by_what_is_said(client: httpx.Client) -> None:
    for path in ("/categories", "/categories/stool"):
        answer = client.get(path)
        tag = answer.headers["etag"]
        assert not tag.startswith("W/")
        assert answer.headers["cache-control"] == "no-cache"
        for call in (client.get, client.head):
            again = call(path, headers={"if-none-match": tag})
            assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", tag)
            assert again.headers["cache-control"] == "no-cache"
        assert client.head(path).headers["etag"] == tag
        assert client.get(path, headers={"if-none-match": '"other"'}).status_code == 200
    tags = {client.get(path).headers["etag"] for path in ("/categories", "/categories/stool")}
    assert len(tags) == 2
