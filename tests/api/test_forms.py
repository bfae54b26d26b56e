from __future__ import annotations

import tempfile
from typing import Any

import httpx
import pytest

from service.constraints import Interval
from service.requests import EditOptions, InferOptions

MESH = ("chair.obj", b"abc", "model/obj")


def test_the_upload_reaches_the_pipeline_as_it_is(client: httpx.Client, pretend: Any) -> None:
    assert client.post("/infer", files={"mesh": MESH}).status_code == 200
    upload = pretend.calls[0]["upload"]
    assert (upload.data, upload.name, upload.content_type) == (b"abc", "chair.obj", "model/obj")
    assert pretend.calls[0]["options"] == InferOptions()
    assert list(pretend.calls[0]["models"]) == ["stool", "stool@1"]


def test_the_options_reach_the_pipeline(client: httpx.Client, pretend: Any) -> None:
    data = {
        "category": "stool", "up": "+z", "front": "-y", "units": "mm", "refine": "false",
        "edits": "{}", "mode": "paper", "keep": "seat", "format": "stl", "strict": "true",
        "constraints": '{"seat_width": {"max": 0.5}}',
    }  # fmt: skip
    assert client.post("/edit", files={"mesh": MESH}, data=data).status_code == 200
    call = pretend.calls[0]
    assert call["options"] == InferOptions(
        category="stool", up="+z", front="-y", units="mm", refine=False
    )
    assert call["edit_options"] == EditOptions(mode="paper", keep="seat", format="stl", strict=True)
    assert call["constraints"] == {"seat_width": Interval(high=0.5)}


def test_edits_or_constraints_are_enough_and_one_is_needed(
    client: httpx.Client, pretend: Any, problem: Any
) -> None:
    for name in ("edits", "constraints"):
        response = client.post("/edit", files={"mesh": MESH}, data={name: "{}"})
        assert response.status_code == 200
        assert (pretend.calls[-1]["edits"], dict(pretend.calls[-1]["constraints"])) == ({}, {})
    document = problem(client.post("/edit", files={"mesh": MESH}), 422, "field_missing")
    assert "'edits'" in document.detail


@pytest.mark.parametrize(
    ("text", "value"), [("true", True), ("1", True), ("false", False), ("0", False)]
)
def test_booleans(client: httpx.Client, pretend: Any, text: str, value: bool) -> None:
    client.post("/infer", files={"mesh": MESH}, data={"refine": text})
    assert pretend.calls[0]["options"].refine is value


def test_no_mesh(client: httpx.Client, problem: Any) -> None:
    problem(client.post("/infer"), 422, "mesh_missing")
    problem(client.post("/infer", data={"up": "+y"}), 422, "mesh_missing")
    problem(client.post("/infer", data={"mesh_id": ""}), 422, "mesh_missing")


def test_two_meshes(client: httpx.Client, problem: Any) -> None:
    twice = [("mesh", MESH), ("mesh", MESH)]
    problem(client.post("/infer", files=twice), 422, "mesh_ambiguous")
    both = client.post("/infer", files={"mesh": MESH}, data={"mesh_id": "sha256-0"})
    problem(both, 422, "mesh_ambiguous")


def test_a_repeated_option(client: httpx.Client, problem: Any) -> None:
    response = client.post("/infer", files={"mesh": MESH}, data={"up": ["+y", "+z"]})
    assert "'up'" in problem(response, 422, "field_repeated").detail


def test_an_unselected_file_beside_an_id_is_no_mesh(client: httpx.Client) -> None:
    mesh_id = client.post("/infer", files={"mesh": MESH}).json()["mesh_id"]
    # What a browser sends for an empty file input.
    response = client.post("/infer", files={"mesh": ("", b"")}, data={"mesh_id": mesh_id})
    assert response.json()["mesh_id"] == mesh_id


@pytest.mark.parametrize("content_type", ["application/json", "model/gltf-binary", "text/plain"])
def test_a_body_that_is_no_form(client: httpx.Client, problem: Any, content_type: str) -> None:
    response = client.post("/edit", content=b"{}", headers={"content-type": content_type})
    assert content_type in problem(response, 415, "body_not_a_form").detail


def test_an_upload_of_megabytes_needs_no_temporary_folder(
    client: httpx.Client, pretend: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "TemporaryFile", None)
    data = bytes(3_000_000)
    assert client.post("/infer", files={"mesh": ("a.obj", data)}).status_code == 200
    assert pretend.calls[0]["upload"].data == data
