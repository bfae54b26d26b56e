from __future__ import annotations

import json
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import httpx
import numpy as np
import pytest
import trimesh
from fastapi import FastAPI
from plain_chair import PLAIN

from service import pipeline
from service.api.schemas import TransferReport
from service.errors import InvalidRequest
from service.mesh.formats import read_mesh
from service.template.loader import load_template

JSON = {"accept": "application/json"}
SOURCE, TARGET = ("my chair.obj", b"abc"), ("other.glb", b"def")
BOTH = {"source": SOURCE, "target": TARGET}


@pytest.fixture(autouse=True)
def calls(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> list[Any]:
    """What the pretended pipeline was asked, where it is pretended."""
    asked: list[Any] = []

    def transfer(*arguments: Any) -> Any:
        asked.append(arguments)
        return SimpleNamespace(
            data=arguments[0].data + b" like " + arguments[1].data,
            format="obj",
            media_type="model/obj",
            parameters={"seat_width": 0.5},
            report={
                "category": "stool",
                "model": {"name": "stool", "version": "1", "digest": "sha256-00"},
                "parameters": {"seat_width": {"before": 0.1, "after": 0.5, "unit": "m"}},
                "derived": {},
                "dimensions": {},
                "vertices": {"total": 3, "moved": 2},
                "flipped_faces": 0,
                "warnings": [],
                "transfer": {
                    "parameters": ["seat_width"],
                    "size": "target",
                    "position": "source",
                    "scale": 1.0,
                    "target": {"seat_width": {"value": 0.5, "unit": "m"}},
                },
            },
        )

    if "client" in request.fixturenames or "pretend_app" in request.fixturenames:
        monkeypatch.setattr(pipeline, "transfer", transfer)
    return asked


def post(client: httpx.Client, files: Any = BOTH, data: Any = None, headers: Any = None) -> Any:
    return client.post("/transfer", files=files, data=data, headers=headers)


def test_the_sources_file_comes_with_its_headers(client: httpx.Client) -> None:
    response = post(client)
    assert response.content == b"abc like def"
    assert response.headers["content-type"] == "model/obj"
    assert "my_chair-edited.obj" in response.headers["content-disposition"]
    assert response.headers["shape-parameters"] == '{"seat_width":0.5}'
    assert response.headers["vary"] == "Accept"


def test_the_form_is_what_the_pipeline_is_asked(client: httpx.Client, calls: list[Any]) -> None:
    data = {
        "category": "stool", "up": "+z", "front": "-y", "units": "cm", "target_up": "+x",
        "target_front": "+z", "refine": "false", "parameters": '["seat_width", "seat_depth"]',
        "size": "source", "position": "target", "keep": "floor", "mode": "paper",
        "format": "ply", "strict": "true",
    }  # fmt: skip
    assert post(client, data=data).status_code == 200
    assert post(client, data={"units": "cm", "target_units": "in"}).status_code == 200
    source, target, models, options, target_options, how, known = calls[0]
    assert (source.data, source.name, target.data, target.name) == (
        b"abc", "my chair.obj", b"def", "other.glb"
    )  # fmt: skip
    assert "stool" in models
    assert known is not None
    assert vars(options) == {
        "category": "stool", "up": "+z", "front": "-y", "units": "cm", "refine": False
    }  # fmt: skip
    assert vars(target_options) == vars(options) | {"up": "+x", "front": "+z"}
    assert vars(how) == {
        "mode": "paper", "keep": "floor", "format": "ply", "strict": True,
        "parameters": ("seat_width", "seat_depth"), "size": "source", "position": "target",
    }  # fmt: skip
    assert [calls[1][index].units for index in (3, 4)] == ["cm", "in"]


def test_the_report_names_all_three_meshes_and_they_are_kept(client: httpx.Client) -> None:
    response = post(client, headers=JSON)
    report = TransferReport.model_validate_json(response.content, extra="forbid")
    kept = {
        report.source_mesh_id: b"abc", report.target_mesh_id: b"def",
        report.mesh_id: b"abc like def",
    }  # fmt: skip
    assert {name: client.get(f"/meshes/{name}").content for name in kept} == kept


def test_ids_stand_for_the_files(client: httpx.Client) -> None:
    first = post(client, headers=JSON).json()
    ids = {"source_mesh_id": first["source_mesh_id"], "target_mesh_id": first["target_mesh_id"]}
    by_ids = client.post("/transfer", data=ids)
    assert by_ids.content == b"abc like def"
    one = {"target_mesh_id": first["target_mesh_id"]}
    mixed = post(client, {"source": ("a.ply", b"xyz")}, one)
    assert mixed.content == b"xyz like def"
    onward = post(client, {"target": TARGET}, {"source_mesh_id": first["mesh_id"]})
    assert onward.content == b"abc like def like def"


def test_the_tag_is_of_both_meshes(client: httpx.Client, calls: list[Any]) -> None:
    etag = post(client).headers["etag"]
    headers = {"if-none-match": etag}
    again = post(client, headers=headers)
    assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", etag)
    assert len(calls) == 1
    others = (
        {"files": {"source": SOURCE, "target": ("other.glb", b"deg")}},
        {"files": {"source": TARGET, "target": SOURCE}},
        {"data": {"size": "source"}},
        {"data": {"target_up": "+z"}},
    )
    assert [post(client, headers=headers, **other).status_code for other in others] == [200] * 4


def test_a_report_that_the_client_holds_is_not_sent_again(
    client: httpx.Client, calls: list[Any]
) -> None:
    etag = post(client, headers=JSON).headers["etag"]
    assert post(client, headers=JSON | {"if-none-match": etag}).status_code == 304
    assert len(calls) == 1


@pytest.mark.parametrize(
    ("files", "data", "code"),
    [
        ({"target": TARGET}, {}, "source_missing"),
        ({"source": SOURCE}, {}, "target_missing"),
        ({"source": SOURCE}, {"target_mesh_id": ""}, "target_missing"),
        (BOTH, {"source_mesh_id": "sha256-00"}, "source_ambiguous"),
        (BOTH, {"target_mesh_id": "sha256-00"}, "target_ambiguous"),
        ([("source", SOURCE), ("source", SOURCE)], {}, "source_ambiguous"),
        (
            [("target", SOURCE), ("target", SOURCE)],
            {"source_mesh_id": "sha256-00"},
            "mesh_id_unknown",
        ),
        (BOTH, {"size": ["target", "source"]}, "field_repeated"),
        ({"mesh": SOURCE}, {}, "unknown_field"),
        (BOTH, {"size": "huge"}, "field_invalid"),
        (BOTH, {"position": "moon"}, "field_invalid"),
        (BOTH, {"parameters": "[1]"}, "names_malformed"),
        ({"source": SOURCE}, {"target": "text"}, "field_invalid"),
    ],
)
def test_forms_that_make_no_sense(
    client: httpx.Client, problem: Any, files: Any, data: Any, code: str
) -> None:
    status = 404 if code == "mesh_id_unknown" else 422
    document = problem(post(client, files, data), status, code)
    which = code.split("_")[0]
    if which in ("source", "target"):
        assert which in document.detail
        assert f"`{which}`" in document.suggestion
        assert f"`{which}_mesh_id`" in document.suggestion


def test_an_unknown_id_is_told_with_whose_it_is(client: httpx.Client, problem: Any) -> None:
    for which, other in (("source", "target"), ("target", "source")):
        response = post(client, {other: SOURCE}, {f"{which}_mesh_id": "sha256-" + "0" * 64})
        assert problem(response, 404, "mesh_id_unknown").detail.startswith(f"{which}: ")
    plain = client.post("/infer", data={"mesh_id": "sha256-" + "0" * 64})
    assert not problem(plain, 404, "mesh_id_unknown").detail.startswith("mesh:")


def test_a_third_file_is_too_many(client: httpx.Client, problem: Any) -> None:
    files = [("source", SOURCE), ("target", TARGET), ("source", SOURCE)]
    document = problem(post(client, files), 400, "files_too_many")
    assert "the `source` and the `target` of a transfer" in document.suggestion


def test_both_files_count_towards_the_bodys_limit(
    pretend_app: Callable[..., FastAPI], serve: Any, problem: Any
) -> None:
    client = serve(pretend_app(max_upload_bytes=3000))
    half = b"x" * 1800
    assert post(client, {"source": ("a.obj", half), "target": TARGET}).status_code == 200
    files = {"source": ("a.obj", half), "target": ("b.obj", half)}
    problem(post(client, files), 413, "body_too_large")


def test_the_pipelines_refusals_are_problems(
    client: httpx.Client, problem: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: Any) -> Any:
        raise InvalidRequest("categories_differ", "the source is ...", "Send category=chair.")

    monkeypatch.setattr(pipeline, "transfer", refuse)
    problem(post(client), 422, "categories_differ")


def test_it_is_counted_as_an_edit_on_a_route_of_its_own(client: httpx.Client) -> None:
    assert post(client).status_code == 200
    text = client.get("/metrics").text
    assert 'route="/transfer"' in text
    timing = post(client).headers["server-timing"]
    assert "total;dur=" in timing


def test_it_is_documented(service_client: httpx.Client) -> None:
    spec = service_client.get("/openapi.json").json()
    operation = spec["paths"]["/transfer"]["post"]
    assert {"200", "304", "401", "404", "413", "422", "429"} <= set(operation["responses"])
    schema = spec["components"]["schemas"]["TransferForm"]["properties"]
    assert schema["category"]["default"] == "auto"
    assert schema["source"]["description"]
    assert schema["size"]["enum"] == ["target", "source"]


WIDE = PLAIN | {"seat_width": 0.6, "leg_height": 0.5}


@pytest.fixture(scope="module")
def wide_ply() -> bytes:
    """Another chair, in centimetres."""
    template = load_template("paper_chair")
    vertices = 100.0 * template.decode([WIDE[name] for name in template.names])
    return bytes(trimesh.Trimesh(vertices, template.faces, process=False).export(file_type="ply"))


HOW = {"category": "chair", "up": "+y", "front": "+z", "target_up": "+y", "target_front": "+z"}


def test_a_chair_is_made_like_another(
    service_client: httpx.Client, chair_glb: bytes, wide_ply: bytes
) -> None:
    files = {"source": ("chair.glb", chair_glb), "target": ("wide.ply", wide_ply)}
    data = HOW | {"target_units": "cm"}
    response = post(service_client, files, data)
    assert response.status_code == 200, response.text
    assert response.headers["content-type"] == "model/gltf-binary"
    assert 'filename="chair-edited.glb"' in response.headers["content-disposition"]
    values = json.loads(response.headers["shape-parameters"])
    assert {name: values[name] for name in WIDE} == pytest.approx(WIDE, abs=0.015)
    moved = read_mesh(response.content, "a.glb")
    np.testing.assert_allclose(np.ptp(moved.vertices, axis=0)[0], 0.6, atol=0.015)
    np.testing.assert_array_equal(moved.faces, read_mesh(chair_glb, "a.glb").faces)
    report = post(service_client, files, data, JSON)
    told = TransferReport.model_validate_json(report.content, extra="forbid")
    assert service_client.get(f"/meshes/{told.mesh_id}").content == response.content
    assert told.transfer.target["seat_width"].unit == "m"


def test_a_file_like_itself_is_its_own_bytes(
    service_client: httpx.Client, chair_glb: bytes
) -> None:
    files = {"source": ("chair.glb", chair_glb), "target": ("chair.glb", chair_glb)}
    assert post(service_client, files, HOW).content == chair_glb


def test_which_of_two_broken_files_is_told(
    service_client: httpx.Client, problem: Any, chair_glb: bytes
) -> None:
    files = {"source": ("chair.glb", chair_glb), "target": ("broken.glb", b"glTF" + bytes(8))}
    document = problem(post(service_client, files, HOW), 415, "gltf_version")
    assert document.detail.startswith("target: ")
