"""Callers, paths, forms and options that make no sense; any category does for them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import httpx
import pytest
import trimesh
from provoke import BOX, client_of, provokes, refused, told

from service.api.keys import Entry, digest_of, new_key
from service.client import ShapeClient
from service.main import create_app
from service.settings import Settings

KEY = new_key()
PAGE = "https://shapes.example"
MESH = {"mesh": BOX}


@pytest.fixture(scope="module")
def boxes(serving: Any) -> Iterator[httpx.Client]:
    """A service that knows boxes alone."""
    with serving(create_app(Settings(categories=("debug",), workers=1))) as http:
        yield http


@pytest.fixture(scope="module")
def client(boxes: httpx.Client) -> ShapeClient:
    """Its client."""
    return client_of(boxes)


@pytest.fixture(scope="module")
def guarded(serving: Any) -> Iterator[httpx.Client]:
    """A service that lets in who has the key, and pages of one origin."""
    keys = str(Entry("ann", digest_of(KEY)))
    settings = Settings(categories=("debug",), workers=1, api_keys=keys, cors_origins=PAGE)
    with serving(create_app(settings)) as http:
        yield http


@provokes(key_missing=401, key_unknown=401)
def test_who_may_call(guarded: httpx.Client, code: str) -> Any:
    assert client_of(guarded, api_key=KEY).infer(BOX).category == "debug"
    key = {"key_missing": None, "key_unknown": new_key()}[code]
    return refused(lambda: client_of(guarded, api_key=key).infer(BOX))


@provokes(cross_site=403)
def test_a_page_of_another_origin(client: ShapeClient) -> Any:
    headers = {"Sec-Fetch-Site": "cross-site", "Origin": PAGE}
    return refused(lambda: client.post("/infer", files=MESH, headers=headers))


@provokes(cors_refused=400)
def test_a_page_that_asks_before(guarded: httpx.Client) -> Any:
    headers = {"Origin": PAGE + ".evil", "Access-Control-Request-Method": "POST"}
    client = client_of(guarded, api_key=KEY)
    return refused(lambda: client.post("/infer", method="OPTIONS", headers=headers))


@provokes(not_found=404, method_not_allowed=405)
def test_paths_and_methods(client: ShapeClient, code: str) -> Any:
    method, path = {"not_found": ("GET", "/nowhere")}.get(code, ("PUT", "/infer"))
    return refused(lambda: client.post(path, method=method))


FORMS: dict[str, dict[str, Any]] = {
    "field_invalid": {"files": MESH, "fields": {"edits": "{}", "strict": "perhaps"}},
    "field_missing": {"files": MESH},
    "field_repeated": {"files": MESH, "fields": [("edits", "{}"), ("edits", "{}")]},
    "field_too_large": {"files": MESH, "fields": {"edits": " " * 300_000}},
    "fields_too_many": {"files": MESH, "fields": {f"f{n}": "x" for n in range(50)}},
    "files_too_many": {"files": [("mesh", BOX)] * 5},
    "mesh_ambiguous": {"files": MESH, "fields": {"mesh_id": "sha256-00", "edits": "{}"}},
    "mesh_missing": {"fields": {"edits": "{}"}},
    "unknown_field": {"files": MESH, "fields": {"edit": "{}"}},
}
STATUSES = {"field_too_large": 413, "fields_too_many": 400, "files_too_many": 400}


@provokes(**{code: STATUSES.get(code, 422) for code in FORMS})
def test_a_form(client: ShapeClient, code: str) -> Any:
    return refused(lambda: client.post("/edit", **FORMS[code]))


@provokes(body_malformed=400, body_not_a_form=415)
def test_a_body_that_is_no_form(boxes: httpx.Client, code: str) -> Any:
    kind = {"body_malformed": "multipart/form-data; boundary=x"}.get(code, "application/json")
    answer = boxes.post("/edit", content=b"{}", headers={"Content-Type": kind})
    return told(answer.status_code, answer.content)


@provokes(source_missing=422, source_ambiguous=422, target_missing=422, target_ambiguous=422)
def test_a_form_of_two(client: ShapeClient, code: str) -> Any:
    part, _, fault = code.partition("_")
    files = {"source": BOX, "target": BOX}
    fields = {}
    if fault == "missing":
        del files[part]
    else:
        fields[f"{part}_mesh_id"] = "sha256-00"
    return refused(lambda: client.post("/transfer", files=files, fields=fields))


@provokes(mesh_id_unknown=404)
def test_an_id_of_nothing(client: ShapeClient) -> Any:
    return refused(lambda: client.mesh("sha256-" + "0" * 64))


@provokes(unknown_category=404)
def test_a_category_that_there_is_not(client: ShapeClient) -> Any:
    return refused(lambda: client.category("bench"))


@provokes(unknown_category=422)
def test_a_category_that_there_is_not_in_a_form(client: ShapeClient) -> Any:
    return refused(lambda: client.infer(BOX, category="bench"))


VAST = bytes(trimesh.creation.box((0.5e30, 1e30, 2e30)).export(file_type="glb"))
"""So large that a further edit goes beyond what a float holds."""

EDITS: dict[str, dict[str, Any]] = {
    "constraints_conflict": {"constraints": {"width": {"max": 0}}},
    "constraint_malformed": {"constraints": {"width": {"most": 1}}},
    "dimension_fixed": {"edits": {"width": 0.3, "total_width": 0.5}},
    "edit_malformed": {"edits": {"width": {"grow": 2}}},
    "overflow": {"mesh": VAST, "edits": {"width": {"scale": 1e11}}},
    "parallel_axes": {"edits": {}, "up": "+y", "front": "-y"},
    "size_not_positive": {"edits": {"width": -1}},
    "unknown_keep": {"edits": {}, "keep": "ceiling"},
    "unknown_parameter": {"edits": {"wings": 2}},
}


@provokes(**dict.fromkeys(EDITS, 422))
def test_an_edit(client: ShapeClient, code: str) -> Any:
    asked = {"mesh": BOX, **EDITS[code]}
    refusal = refused(lambda: client.edit(asked.pop("mesh"), **asked))
    assert bool(refusal.conflicts) == (code == "constraints_conflict")
    return refusal


@provokes(
    edits_not_json=422, edits_not_object=422, constraints_not_json=422, constraints_not_object=422
)
def test_what_is_no_json(client: ShapeClient, code: str) -> Any:
    field, _, fault = code.partition("_not_")
    fields = {field: {"json": "{", "object": "[]"}[fault]}
    return refused(lambda: client.post("/edit", files=MESH, fields=fields))


@provokes(names_malformed=422, parameters_empty=422)
def test_a_list_of_names(client: ShapeClient, code: str) -> Any:
    fields = {"parameters": {"names_malformed": "[", "parameters_empty": "[]"}[code]}
    return refused(lambda: client.post("/sliders", files=MESH, fields=fields))
